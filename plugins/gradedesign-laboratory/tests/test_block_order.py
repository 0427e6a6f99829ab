"""Tractions below periodic below displacements, in the sense of energies, for every cell.

Hazanov and Huet, J. Mech. Phys. Solids 42 (1994) 1995. It holds for the voxels as they are, however
few: fields that satisfy one condition are among those of the next. The void carries 1e-3 of the
solid's stiffness in all three. How tight it is, is tested on layers (`test_homogenise_block`): this
one sees a condition that is not what it says, not an error of one per cent.
"""

import numpy as np
import pytest

from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign.mechanics.homogenise.sampling import cell_fill
from gradedesign.program.host.registry import build_registry
from gradedesign_laboratory.block import filled_void, solve_block

REGISTRY = build_registry()
VOXELS = 8
#: Stiffnesses are right to the square of it.
RTOL = 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.02, 0.5, 0.98])
@pytest.mark.parametrize("name", sorted(REGISTRY.cell_families))
def test_conditions_are_in_order_for_every_cell(name, share):
    # At a share of the way through its window, by logarithm.
    family = REGISTRY.cell_families[name]
    low, high = calibrate(family, None).window
    rho = low ** (1 - share) * high**share
    fill = filled_void(cell_fill(calibrate(family), rho, VOXELS, share_ties=True))
    upper = solve_block(fill, "displacement", rtol=RTOL).stiffness
    lower = solve_block(fill, "traction", rtol=RTOL).stiffness
    middle = solve_periodic(fill, rtol=RTOL).stiffness
    slack = 1e-6 * middle[0, 0]
    assert np.linalg.eigvalsh(upper - middle)[0] > -slack
    assert np.linalg.eigvalsh(middle - lower)[0] > -slack
    # Apart, so that equal matrices would not pass.
    assert np.linalg.eigvalsh(upper - lower)[-1] > 0.005 * middle[0, 0]
