"""What the user asks: schema, quantities with units, regions, loading."""
