"""The result of a run: its record and its words."""
