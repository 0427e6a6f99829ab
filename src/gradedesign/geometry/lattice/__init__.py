"""The lattice in its part: cells, density, skins, passive regions, joints, drains; its surface."""
