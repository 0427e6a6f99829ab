"""Explicit analyses of a printed solid: their protocol, the built-in one, their measures."""
