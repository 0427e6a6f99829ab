"""File formats of surfaces and fields, one file a format, read and written.

Door: `Exporter`, `PrintedLattice`, `PlannedPrint`, `FieldSet`.
"""
