"""Explicit analysis, windows, correction, limits, printability."""
