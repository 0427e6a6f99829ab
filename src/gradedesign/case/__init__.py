"""The user's case file: schema, quantities with units, regions, loading."""
