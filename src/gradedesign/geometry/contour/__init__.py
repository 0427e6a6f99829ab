"""From any implicit field to closed triangles: contour, sharp edges, islands, closed voids.

Door: `extract_surface`, `grid_points`, `Islands`, `require_closed`, `Resolution`.
"""
