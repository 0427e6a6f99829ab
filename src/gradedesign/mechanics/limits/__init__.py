"""Limits, one file a kind: value, gradient, row of the verdict, band."""
