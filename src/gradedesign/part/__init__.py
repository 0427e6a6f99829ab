"""The solid: readers, repair, smooth faces, selection, signed distance, its tetrahedra."""
