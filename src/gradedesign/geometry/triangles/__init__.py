"""Triangle surfaces and what is asked of them.

Door: `SurfaceMesh`, `corner_points`, `enclosed_volume`, `build_triangle_tree`, `ray_lengths`,
`winding_numbers`.

One tree answers for closest points, rays (`triangle_tree`) and winding numbers of triangles that
may leave holes (`winding`); one grid classifier for inside and outside of closed surfaces, at
points and on grids (`grid_classifier`).
"""
