"""Materials, and laws of stiffness and strength over relative density."""
