"""How stiff few of these cells are, as plain data with provenance."""
