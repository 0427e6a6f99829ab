"""Composing fields: trim, skin; sampling in bricks; surface."""
