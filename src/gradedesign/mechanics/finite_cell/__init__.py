"""Elasticity on a plain grid that any implicit field cuts: quadratic finite cells."""
