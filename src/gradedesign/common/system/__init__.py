"""The machine below: progress, cache, worker processes, limits of time and memory, whole files.

Door: `report_step`, `stepping`, `Listener`, `in_ranges`, `content_key`, `write_text`, `Deadline`.
"""
