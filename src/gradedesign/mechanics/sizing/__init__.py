"""The homogenised part and its optimiser: densities that meet every limit."""
