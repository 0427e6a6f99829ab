"""Limits, one file a kind: value, gradient, row of the verdict, band.

Door: `Limit`, `LimitKind`, `LimitRow`, `LimitKey`, `LimitsSpec`, `Banded`, `limit_rows`,
`all_hold`.
"""
