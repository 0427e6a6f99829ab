"""The printed surface judged: whole at two resolutions, remeshed whole or in windows.

Door: `Acceptance`, `PrintedBody`, `choose_scope`, `judge_whole`.
"""
