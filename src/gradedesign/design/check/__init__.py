"""A case looked at without analysis, and drafts of cases."""
