"""Files for people and printers: stl, vtu, pictures, report."""
