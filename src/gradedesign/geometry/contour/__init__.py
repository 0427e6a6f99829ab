"""From any implicit field to closed triangles: contour, sharp edges, islands, closed voids."""
