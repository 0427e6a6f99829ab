"""Surface or field to tetrahedra: the pytetwild worker, stuffing, quality gates."""
