"""Triangle surfaces and what is asked of them.

One tree answers for closest points, rays (`triangle_tree`) and winding numbers of triangles that
may leave holes (`winding`); one grid classifier for inside and outside of closed surfaces, at
points and on grids (`grid_classifier`).
"""
