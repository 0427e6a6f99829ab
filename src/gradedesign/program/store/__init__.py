"""The run folder: one run at a time, every file accounted for, stages to resume from."""
