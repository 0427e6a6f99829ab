"""The lattice in its part: cells, density, skins, passive regions, joints, drains; its surface.

Door: `DesignDomain`, `LatticeDesign`, `LatticeSpec`, `SolidComponent`, `ComponentKind`,
`DensityGrid`, `lattice_field`.
"""
