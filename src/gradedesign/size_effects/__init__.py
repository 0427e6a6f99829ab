"""Size effects: stiffness and strength of walls with few cells through the thickness."""
