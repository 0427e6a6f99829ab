"""Files of a finished run: result, report, fields, pictures.

Door: `Output`, `write_outputs`, `finished_result`.
"""
