"""The result of a run: its record and its words.

Door: `RunResult`, `Shown`, `as_json`, `from_json`.
"""
