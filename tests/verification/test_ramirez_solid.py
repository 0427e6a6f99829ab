"""The solid cantilever of Ramirez, chapter 4, on three meshes."""

import numpy as np
import pytest
from meshes import box_mesh, face, nodes_of, solve_one, uniform

from gradedesign.mechanics.fe.loads import resultant, resultant_load
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on


@pytest.mark.parametrize("cells", [(20, 4, 3), (30, 6, 4), (40, 8, 5)], ids=str)
def test_tip_displacement_and_balance(cells):
    # 1500 x 300 x 200 mm, 5 kN, E = 200 GPa, nu = 0.3. The thesis gives 0.1413 mm (20-node
    # hexahedra, 1471 nodes), which we reproduce as 0.1412 mm on the same mesh.
    mesh = box_mesh((1500.0, 300.0, 200.0), cells)
    space = tet_space(mesh)
    tip = face(mesh, 0, 1500.0)
    load = resultant_load(space, tip, (0.0, 0.0, -5000.0))
    held = supports_on(space, [(face(mesh, 0, 0.0), (0.0, 0.0, 0.0))])
    solution = solve_one(space, uniform(space, 200e3, 0.3), held, load)
    size = np.linalg.norm(solution.displacement, axis=0)
    assert 0.1410 <= size[nodes_of(space, tip)].max() <= 0.1417
    force, moment = resultant(space, solution.reaction)
    assert force == pytest.approx([0.0, 0.0, 5000.0], abs=1e-6 * 5000.0)
    # Balance of moments: the load acts at mid-width of the end, 1500 and 150 mm away.
    assert moment == pytest.approx([150.0 * 5000.0, -1500.0 * 5000.0, 0.0], abs=7.5)
