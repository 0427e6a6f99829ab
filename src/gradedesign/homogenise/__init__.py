"""A cell's effective stiffness and strength from voxel analysis of one period."""
