"""The whole printed surface is what acceptance judges, not the field it was made from."""

from types import SimpleNamespace

import numpy as np
import pytest
from finite_cell_solids import STEEL, box_field, box_regions, load_case, newtons
from manifold3d import Manifold
from plain_cells import plain_cells
from small_parts import zone_of

from gradedesign.common.system.progress import ignore
from gradedesign.design.acceptance.whole_solid import judge_whole
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.loop.bodies import judge_bodies, variant_spreads, with_other_body
from gradedesign.design.loop.printed_stage import printed_stage
from gradedesign.design.printing.as_built_body import StatedProcess, as_built_body
from gradedesign.design.printing.process import Process
from gradedesign.errors import LatticeError
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


def pulled_bar(size=0.5):
    """A bar of 4 x 2 x 1 mm pulled by 5 N, its analysis of the iteration, and the limit of its tip.

    Bricks of a size as in the iteration, mm, then finer.
    """
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
    division = SimpleNamespace(unknowns=1000)
    analysed = SimpleNamespace(
        solid=solid,
        result=SimpleNamespace(
            volume=8.0, mesh_size=size, solved=SimpleNamespace(division=division)
        ),
    )
    part = SimpleNamespace(surface=box_surface(HIGH))
    domain = SimpleNamespace(closed=False)
    sheets = calibrate(build_registry().cell_families["gyroid-sheet"])
    key = LimitKey(kind="displacement", region="x1", component="x", load_case="pull")
    limit = DisplacementLimit(key=key, name="tip", allowed=1.0, nodes=np.array([0]), component=0)
    setup = SimpleNamespace(
        plan=SimpleNamespace(
            case=case,
            part=part,
            domain=domain,
            tools=SimpleNamespace(analysis=FINITE_CELLS),
        ),
        limits=[limit],
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
    return setup, analysed, limit


def test_a_file_of_half_the_section_moves_twice_as_far():
    """Of a bar of 4 x 2 x 1 mm the file holds the middle 4 x 1 x 1 mm only."""
    bar = box_surface((4.0, 1.0, 1.0))
    printed = SurfaceMesh(vertices=bar.vertices + np.array([0.0, 0.5, 0.0]), faces=bar.faces)
    setup, analysed, limit = pulled_bar()
    rho = np.array([0.3])
    stage = printed_stage(setup, printed, analysed.solid, analysed.result, rho, ignore)
    found = judge_whole([limit], stage)
    (row,) = found.rows
    # F L / (E A) with A = 1 mm^2; the clamp holds back some contraction.
    assert row.value == pytest.approx(5.0 * 4.0 / (200e3 * 1.0), rel=0.02)
    assert row.band.half_width < 0.02
    assert len(row.band.sizes_mm) == 2
    assert row.judged_by == "finite cells on the whole printed surface"
    assert found.result.volume == pytest.approx(4.0, rel=1e-3)


#: A duct of 0.8 x 0.4 mm along the bar, whose walls grow by 0.1 mm, ceiling and floor by 0.05 mm; E
#: is 0.8 of the material's.
GROWN = Process(name="p", offset=((0.0, 0.05), (90.0, 0.1), (180.0, 0.05)), stiffness=0.8)
DUCT = (0.8, 0.4)


def ducted_bar():
    """The bar of 4 x 2 x 1 mm with a duct through its middle."""
    duct = Manifold.cube((5.0, *DUCT)).translate((-0.5, 0.6, 0.3))
    made = (Manifold.cube((4.0, 2.0, 1.0)) - duct).to_mesh64()
    return SurfaceMesh(
        vertices=np.asarray(made.vert_properties)[:, :3],
        faces=np.asarray(made.tri_verts).astype(np.int64),
    )


def tip(width, height, modulus):
    """F L / (E A) of the bar with a duct of these edges."""
    return 5.0 * 4.0 / (modulus * (2.0 - width * height))


def judged_bodies(stated, strut):
    """The bar with its duct, designed and as built by a process, on elements of 0.2 mm."""
    setup, analysed, limit = pulled_bar(0.2)

    def staged(surface, solid):
        return printed_stage(setup, surface, solid, analysed.result, np.array([0.3]), ignore)

    surface = ducted_bar()
    built = as_built_body(stated, surface, box_surface(HIGH), strut)
    return judge_bodies([limit], staged, analysed.solid, surface, built, Announcer(ignore))


@pytest.mark.parametrize("judged", ["nominal", "as_built", "both"])
def test_the_as_built_body_is_judged_beside_the_designed_one(judged):
    bodies = judged_bodies(StatedProcess(process=GROWN, judged=judged), 2.0)
    (row,) = with_other_body(bodies, bodies.whole.rows)
    # Section of the duct as built: 0.6 x 0.3 mm. The clamp holds back some contraction.
    nominal, built = tip(0.8, 0.4, 200e3), tip(0.6, 0.3, 160e3)
    assert row.nominal == pytest.approx(nominal, rel=0.04)
    assert row.as_built == pytest.approx(built, rel=0.04)
    # Without the growth it were 8 % off, without the modulus 20 %.
    assert row.as_built / row.nominal == pytest.approx(built / nominal, rel=0.01)
    assert bodies.volumes_mm3["as built"] == pytest.approx(4.0 * (2.0 - 0.6 * 0.3), rel=0.01)
    # The as-built body moves farther: where both count, it decides.
    assert row.value == (row.nominal if judged == "nominal" else row.as_built)
    assert ("as-built surface" in row.judged_by) == (judged != "nominal")
    assert row.bodies_words.startswith(f"nominal {row.nominal:.4g}, as built {row.as_built:.4g}")


def test_a_body_whose_walls_vanish_as_built_has_no_values():
    """The duct grows by 0.5 mm on every side: more is taken away than there is."""
    process = Process(name="p", offset=((0.0, -0.5),))
    bodies = judged_bodies(StatedProcess(process=process, judged="nominal"), 2.0)
    (row,) = with_other_body(bodies, bodies.whole.rows)
    assert row.as_built is None
    assert row.decisive == pytest.approx(tip(*DUCT, 200e3), rel=0.04)
    assert bodies.unknown.startswith("as built: ")
    with pytest.raises(LatticeError, match=r"as built: .*encloses -2.08 mm\^3"):
        judged_bodies(StatedProcess(process=process, judged="both"), 2.0)


def test_random_bodies_spread_a_limit_by_the_scatter_of_their_width():
    """Walls that scatter together over 100 mm: the tip moves as the inverse of the section."""
    process = Process(name="p", offset=((0.0, 0.0),), scatter=0.1)
    bodies = judged_bodies(StatedProcess(process=process, variants=4), 100.0)
    (spread,) = variant_spreads([pulled_bar()[2]], bodies)
    tips = []
    for number in range(1, 5):
        inner = bodies.built.variant(number).vertices
        inner = inner[(inner[:, 1] > 0.1) & (inner[:, 1] < 1.9)]
        tips.append(tip(*np.ptp(inner, axis=0)[1:], 200e3))
    tips = np.array(tips) / tip(*DUCT, 200e3) * bodies.rows_as_built[0].decisive
    low, high = np.quantile(tips, [0.05, 0.95])
    # Elements of 0.3 mm for walls of 0.3 mm, one pair for all: 2 % of the value, a fifth of its
    # spread.
    assert high / low > 1.05
    found = [spread.mean, spread.low, spread.high]
    assert found == pytest.approx([tips.mean(), low, high], rel=0.02)
    assert spread.high - spread.low == pytest.approx(high - low, rel=0.2)
    assert spread.held == 1.0
