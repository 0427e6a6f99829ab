"""The printed surface judged: whole at two resolutions, remeshed whole or in windows."""
