"""Implicit fields, negative inside: their algebra, level sets, and periodic graphs of struts.

Door: `gradient`, `level_set_points`, `periodic_distance_to_segments`.
"""
