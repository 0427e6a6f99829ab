"""The machine below: progress, cache, worker processes, limits of time and memory, whole files."""
