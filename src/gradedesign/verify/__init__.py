"""Explicit analysis, submodels, correction of the homogenised model, acceptance."""
