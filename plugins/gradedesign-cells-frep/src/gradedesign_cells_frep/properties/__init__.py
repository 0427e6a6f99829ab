"""Computed property tables of these cells, as plain data with provenance."""
