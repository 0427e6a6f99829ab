"""Iterations of sizing and explicit analysis with correction and acceptance, and their end."""
