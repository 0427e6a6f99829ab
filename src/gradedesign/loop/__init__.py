"""Rounds of sizing and explicit analysis, correction, acceptance, and what ends them."""
