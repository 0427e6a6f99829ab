"""Analysis to density: stress ratio, optimality, filter, bounds, limits."""
