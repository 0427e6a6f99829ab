"""How the printed solid is made: overhangs, closed voids, thin walls, layers, the printer's room."""
