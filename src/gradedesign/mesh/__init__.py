"""Surface or field to tetrahedra: the pytetwild worker, quality gates."""
