"""The rungs of the ladder: what `pipeline` strings together."""
