"""Materials, and laws of stiffness and strength over relative density.

Door: `Material`, `ScalingLaw`, `LawField`, `PropertyTable`, `power_law`.
"""
