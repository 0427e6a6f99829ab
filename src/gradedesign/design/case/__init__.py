"""The case file: all its tables, read and checked together."""
