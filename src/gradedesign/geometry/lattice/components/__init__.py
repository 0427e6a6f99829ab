"""Components of a lattice, one kind a file: its record, how a case makes it, and its `KIND`."""
