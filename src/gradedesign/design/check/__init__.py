"""A case looked at without analysis, and drafts of cases.

Door: `CaseCheck`, `check_case`, `FirstAnswer`, `first_answer`, `DraftCase`.
"""
