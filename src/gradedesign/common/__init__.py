"""Everything stands on this: values of a case file, and the machine below."""
