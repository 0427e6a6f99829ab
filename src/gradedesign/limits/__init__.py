"""Limits: what a design must not exceed, one file for each kind."""
