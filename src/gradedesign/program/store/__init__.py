"""The run folder: one run at a time, every file accounted for, stages to resume from.

Door: `RunFolder`, `open_stages`, `default_folder`.
"""
