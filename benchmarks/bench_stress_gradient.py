"""An L-bracket under a limit of stress alone: mean density by gradients, and what others need.

``python benchmarks/bench_stress_gradient.py``. The L of the study of three phases: 50 x 20 x 50 mm,
arms of 20 mm, 900 N down at the end of one, held at the end of the other, tetrahedra of 5 mm,
filter of 10 mm. The uniform lattice is sized beside it; the stress ratio (a lower bound of every
density from its own stress, as sizing was before) stands as recorded on the same model.

Mean densities, one thread (processor seconds):

| cell, allowed, window | uniform | stress ratio | gradients | over stress ratio | steps | s |
|---|---|---|---|---|---|---|
| gyroid-network, 150 MPa, 0.15 to 0.60 | 0.505 | 0.423 | 0.349 | 0.83 | 17 | 2.8 |
| gyroid-network, 300 MPa, 0.08 to 0.78 | 0.333 | 0.238 | 0.200 | 0.84 | 27 | 3.9 |
| bcc, 300 MPa, 0.12 to 0.60 | 0.361 | 0.283 | 0.237 | 0.84 | 28 | 3.7 |

All six rows took 43 s of processor time before slopes of strength surfaces were computed for many
stresses at once and Newton steps kept their arrays, and 29 s after it, in one paired run.
"""

from __future__ import annotations

import time

import numpy as np

from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets, centroids
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.local_stress import StressLimit
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.sizing.filter import cone_filter, uniform_filter
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel, homogenised_model
from gradedesign.mechanics.sizing.size import SizingProblem, size
from gradedesign.program.host.registry import build_registry

#: Cell, allowed stress in MPa, window of density, and the mean density of the stress ratio.
ROWS = (
    ("gyroid-network", 150.0, (0.15, 0.6), 0.4228),
    ("gyroid-network", 200.0, (0.15, 0.6), 0.3205),
    ("gyroid-network", 300.0, (0.15, 0.6), 0.2432),
    ("gyroid-network", 300.0, (0.08, 0.78), 0.2379),
    ("bcc", 300.0, (0.12, 0.6), 0.2828),
    ("gyroid-sheet", 300.0, (0.15, 0.6), 0.1700),
)
#: Titanium, and the force at the end of the arm, N.
TITANIUM = Material(
    name="titanium", youngs_modulus=110e3, poissons_ratio=0.34, density=4.41e-9,
    yield_strength=825.0,
)  # fmt: skip
FORCE, AREA = 900.0, 400.0


def l_bracket(cell: str) -> HomogenisedModel:
    """The homogenised L, its cells along the axes."""
    box = box_part_mesh((50.0, 20.0, 50.0), 5.0)
    x, _, z = centroids(box)
    used, tets = np.unique(box.tets[:, (x < 20) | (z < 20)], return_inverse=True)
    mesh = TetMesh(points=box.points[:, used], tets=np.asarray(tets).reshape(4, -1))
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    px, _, pz = mesh.points[:, facets]
    root, tip = facets[(pz > 50 - 1e-9).all(axis=1)], facets[(px > 50 - 1e-9).all(axis=1)]
    case = PartLoadCase(
        name="pull",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, np.array([0.0, 0.0, -FORCE / AREA])),
        acceleration=np.zeros(3),
    )
    law = build_registry().scaling_laws[f"{cell}-computed"]
    return homogenised_model(space, np.zeros(space.element_count), TITANIUM, law, [case])


def main() -> None:
    for cell, allowed, bounds, ratio in ROWS:
        model = l_bracket(cell)
        points = centroids(model.space.mesh)
        limit = StressLimit(
            key=LimitKey(kind="stress", region="lattice"), name="stress", allowed=allowed,
            percentile=99.5, evaluated=points[2] < 40.0,
        )  # fmt: skip
        means = []
        for matrix in (uniform_filter(points.shape[1]), cone_filter(points, model.volumes, 10.0)):
            begin = time.process_time()
            found = size(SizingProblem(model=model, limits=(limit,), bounds=bounds, filter=matrix))
            means.append(found.history[-1].mean_density)
        took = time.process_time() - begin
        print(
            f"{cell}, {allowed:g} MPa, {bounds[0]:g} to {bounds[1]:g}: uniform {means[0]:.4f}, "
            f"gradients {means[1]:.4f}, over the stress ratio {means[1] / ratio:.3f}, "
            f"{len(found.history)} steps, {took:.1f} s, used {found.history[-1].utilisation:.4f}"
        )


if __name__ == "__main__":
    main()
