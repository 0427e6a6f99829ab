"""Materials, analyses, limits and sizing: no case, no run."""
