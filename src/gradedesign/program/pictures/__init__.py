"""Pictures: scenes, marks and drawing.

Door: `picture_loads`, `picture_lattice`, `action_marks`.
"""
