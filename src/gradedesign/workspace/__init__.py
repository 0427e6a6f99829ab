"""The run folder and the user's cache: atomic files, resume, worker processes, limits, progress."""
