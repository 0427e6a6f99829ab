"""The case file: all its tables, read and checked together.

Door: `Case`, `RunSpec`, `read_case`.
"""
