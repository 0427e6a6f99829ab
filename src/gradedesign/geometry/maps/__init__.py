"""Maps from millimetres to cell coordinates: straight, bent, along frames, graded in size."""
