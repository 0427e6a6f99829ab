"""How the printed solid is made: overhangs, closed voids, thin walls, layers, build volume."""
