"""Check of a case before anything is computed."""
