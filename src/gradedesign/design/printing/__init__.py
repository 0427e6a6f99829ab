"""How the printed solid is made: overhangs, closed voids, thin walls, layers, build volume.

Door: `PrintSpec`, `Printability`, `check_printed`, `wall_thickness`.
"""
