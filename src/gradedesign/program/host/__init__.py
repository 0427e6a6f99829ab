"""The plugin system: hooks, built-in records, the registry.

Door: `load_case`, `build_registry`, `Command`, `completed`, `hookimpl`.
"""
