"""Implicit fields, negative inside: their algebra, level sets, and periodic graphs of struts."""
