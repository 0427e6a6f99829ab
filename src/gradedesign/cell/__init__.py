"""Cell families: calibration, percolation, wall size, maps."""
