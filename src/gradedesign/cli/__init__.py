"""The commands: the only place that prints, catches broadly or exits."""
