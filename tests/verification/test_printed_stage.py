"""The whole printed surface is what acceptance judges, not the field it was made from."""

from types import SimpleNamespace

import numpy as np
import pytest
from finite_cell_solids import STEEL, box_field, box_regions, load_case, newtons
from plain_cells import plain_cells
from small_parts import zone_of

from gradedesign.common.system.progress import ignore
from gradedesign.design.acceptance.whole_solid import judge_whole
from gradedesign.design.loop.printed_stage import printed_stage
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.limits.displacement import DisplacementLimit
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.program.host.registry import build_registry

LOW, HIGH = (0.0, 0.0, 0.0), (4.0, 2.0, 1.0)


def test_a_file_of_half_the_section_moves_twice_as_far():
    """A bar of 4 x 2 x 1 mm whose file holds its middle 4 x 1 x 1 mm only, pulled by 5 N."""
    case = SimpleNamespace(
        load_case=(load_case("pull", [("x0", "xyz")], [("x1", {"force": newtons(5, 0, 0)})]),),
        keep=(),
        run=SimpleNamespace(memory=8e9, time=3600.0),
    )
    design = LatticeDesign(
        domain=DesignDomain(
            distance=box_field(LOW, HIGH), lower=LOW, upper=HIGH, components=(Skin(thickness=1.5),)
        ),
        cells=plain_cells(lambda u: np.cos(2 * np.pi * u).sum(axis=0), -3.0, 3.0),
        cell_map=lambda p: p / 2.0,
        cell_size=2.0,
        density=0.3,
    )
    regions = box_regions(LOW, HIGH)
    solid = PrintedSolid(
        load_cases=case.load_case, memory=8e9, design=design, material=STEEL,
        regions={name: regions[name] for name in ("x0", "x1")},
        support_zones=(zone_of(lambda p: p[0], 1.0),), stress_limit=50.0, percentile=99.0,
    )  # fmt: skip
    bar = box_surface((4.0, 1.0, 1.0))
    printed = SurfaceMesh(vertices=bar.vertices + np.array([0.0, 0.5, 0.0]), faces=bar.faces)
    # Bricks of 0.5 mm as in the iteration, then a third.
    division = SimpleNamespace(unknowns=1000)
    analysed = SimpleNamespace(
        solid=solid,
        result=SimpleNamespace(
            volume=8.0, mesh_size=0.5, solved=SimpleNamespace(division=division)
        ),
    )
    part = SimpleNamespace(surface=box_surface(HIGH))
    domain = SimpleNamespace(closed=False)
    sheets = calibrate(build_registry().cell_families["gyroid-sheet"])
    setup = SimpleNamespace(
        plan=SimpleNamespace(
            case=case, part=part, domain=domain, tools=SimpleNamespace(analysis=FINITE_CELLS)
        ),
        limits=(),
        cells=SimpleNamespace(
            cell=sheets,
            bounds=(0.3, 0.8),
            zoning=None,
            elements_per_wall=1.25,
            layout=SimpleNamespace(typical=2.0),
        ),
        homogenised=SimpleNamespace(
            volumes=np.array([8.0]),
            lattice_volumes=np.array([8.0]),
            solid_fraction=np.array([0.0]),
            space=SimpleNamespace(mesh=None),
        ),
    )
    key = LimitKey(kind="displacement", region="x1", component="x", load_case="pull")
    limit = DisplacementLimit(key=key, name="tip", allowed=1.0, nodes=np.array([0]), component=0)
    found = judge_whole([limit], printed_stage(setup, printed, analysed, np.array([0.3]), ignore))
    (row,) = found.rows
    # F L / (E A) with A = 1 mm^2; the clamp holds back some contraction.
    assert row.value == pytest.approx(5.0 * 4.0 / (200e3 * 1.0), rel=0.02)
    assert row.band.half_width < 0.02
    assert len(row.band.sizes_mm) == 2
    assert row.judged_by == "finite cells on the whole printed surface"
    assert found.result.volume == pytest.approx(4.0, rel=1e-3)
