"""Hook specifications and the registry."""
