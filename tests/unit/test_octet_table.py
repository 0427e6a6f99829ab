"""The shipped table of the octet against finer voxels."""

from importlib import resources

from gradedesign import read_property_table
from gradedesign.mechanics.material.stiffness_constants import constant_errors

#: C11, C12, C44 of the octet, apart from its table: density 0.05 from 64 and 128 voxels along the
#: cell, 0.1 from 48 and 96, filled to the density exactly, a third of the change added.
FINER = {0.05: (0.0103594, 0.0052268, 0.0049415), 0.1: (0.0232369, 0.0116171, 0.0108563)}


def test_the_thin_rows_of_the_shipped_octet_are_right_within_their_errors():
    file = resources.files("gradedesign_cells_strut.properties") / "octet.json"
    shipped = read_property_table(file.read_text(encoding="utf-8"))
    errors = constant_errors(shipped)
    for rho, truth in FINER.items():
        k = list(shipped.density).index(rho)
        c = shipped.stiffness[k]
        for name, value, found in zip(errors, truth, (c[0, 0], c[0, 1], c[3, 3]), strict=True):
            assert abs(found / value - 1) < min(errors[name][k], 0.005), (rho, name)
