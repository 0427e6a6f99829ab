"""The plugin system: hooks, built-in records, the registry."""
