"""Files of a finished run: result, report, fields, pictures."""
