"""Base materials and the records of scaling laws."""
