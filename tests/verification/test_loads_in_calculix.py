"""Remote forces and bearing loads against CalculiX, which brings them onto a mesh by its own means.

The decks are those that a run writes, without their nodal forces: a remote force acts on a
reference node by ``*COUPLING`` and ``*DISTRIBUTING``, a pin as the textbook's pressure on each
facet by ``*DLOAD``. Figures of CalculiX 2.20 stand here for machines without it.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from finite_cell_solids import STEEL, analyse, box_field, load_case, newtons, problem, region
from meshes import box_mesh, face, facets_where, mapped_mesh, mean_on, uniform
from oracles.calculix import needs_ccx, run_calculix

from gradedesign.geometry.part.bore import Bore
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.facets import facet_nodes, facet_owners
from gradedesign.mechanics.fe.load_case import PartLoadCase, case_loads
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.fe.solution import LoadVector, Solution
from gradedesign.mechanics.fe.solve import solve_elastic
from gradedesign.mechanics.fe.space import TetSpace, tet_space
from gradedesign.program.outputs.analysed_model import AnalysedModel, ModelStep
from gradedesign_calculix.calculix import write_calculix

YOUNG, POISSON = 70e3, 0.33
FORCE = np.array([300.0, -400.0, 1000.0])
PIN = np.array([3000.0, 4000.0, 0.0])
#: A plate held at x = 0, and a lug: its bore about z, its shank held at x = -SHANK.
PLATE = (80.0, 30.0, 6.0)
RADIUS, HEAD, SHANK, THICK = 6.0, 14.0, 24.0, 10.0
#: Numbers of the faces of a tetrahedron by the corner opposite (CalculiX CrunchiX manual, C3D4).
FACES = np.array([3, 4, 2, 1])
#: Mean displacement of the loaded region, mm; force (N) and moment about the origin (N mm) of the
#: support: by CalculiX 2.20 on the decks of `in_calculix`.
RECORDED = {
    "plate, remote": np.array(
        [
            [1.91345e-3, -0.126614, 5.92088],
            [-299.997, 400.0, -999.999],
            [-38000.0, 98000.0, 50599.8],
        ]
    ),
    "lug, remote": np.array(
        [
            [4.59599e-4, -6.2534e-3, 0.0199294],
            [-300.0, 400.001, -1000.0],
            [-39000.0, -7499.98, 8699.97],
        ]
    ),
    "lug, bearing": np.array(
        [
            [5.53305e-3, 0.037393, 4.48998e-5],
            [-2998.79, -3998.73, -3.32e-5],
            [20014.9, -14963.6, 0.809213],
        ]
    ),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadedBody:
    """A body with its load case, our solution, and its cards for CalculiX: model and loads."""

    name: str
    space: TetSpace
    facets: dict[str, np.ndarray]
    regions: dict[str, Region]
    case: LoadCaseSpec
    part: PartLoadCase
    solution: Solution
    cards: tuple[list[str], list[str]]


def plate(point):
    """A remote force on the end of a plate."""
    space = tet_space(box_mesh(PLATE, (20, 8, 2)))
    loads = {"force": newtons(*FORCE.tolist()), "point": [f"{v!r} mm" for v in point]}
    ends = face(space.mesh, 0, PLATE[0]), face(space.mesh, 0, 0.0)
    return space, *ends, loads, remote_cards(space, ends[0], point)


def outline():
    """Corners of the lug's bore and outside on common rays, ``(2, n)`` both."""
    turn = np.degrees(np.arctan2(HEAD, SHANK))
    ends = np.radians([-90.0, 90.0, 180.0 - turn, 180.0 + turn, 270.0])
    counts = (36, 14, 8, 14)
    angles = np.concatenate(
        [np.linspace(*ends[k : k + 2], counts[k], endpoint=False) for k in range(4)]
    )
    way = np.array([np.cos(angles), np.sin(angles)])
    behind = np.minimum(way[0], -1e-9)
    shank = np.minimum(HEAD / np.maximum(abs(way[1]), 1e-9), -SHANK / behind)
    return RADIUS * way, np.where(way[0] > -1e-9, HEAD, shank) * way


def lug(loads, cards):
    """A load on the bore of a lug: quadratic tetrahedra with corners on the round faces."""
    inner, outer = outline()
    count = inner.shape[1]

    def moved(u):
        k = np.rint(u[1] * count).astype(int) % count
        # Layers that grow outwards, but less than their distance from the axis.
        size = np.linalg.norm(outer, axis=0)[k] / RADIUS
        return np.array([*(size ** u[0] ** 0.6 * inner[:, k]), THICK * u[2]])

    cut = mapped_mesh((8, count, 3), moved)
    points, index = np.unique(np.round(cut.points, 9) + 0.0, axis=1, return_inverse=True)
    space = tet_space(replace(cut, points=points, tets=index.ravel()[cut.tets]))
    wall = facets_where(space.mesh, lambda x: np.hypot(x[0], x[1]) < RADIUS + 1e-6)
    return space, wall, face(space.mesh, 0, -SHANK), loads, cards(space, wall)


def lug_field(points):
    """Negative inside the lug of the same corners, whose bore and outside are convex."""
    flat = points[:2].reshape(2, -1)
    inner, outer = (beyond(corners, flat).reshape(points.shape[1:]) for corners in outline())
    return np.max([outer, -inner, -points[2], points[2] - THICK], axis=0)


def beyond(corners, flat):
    """Distance beyond the edges of a convex polygon ``(2, n)``, at points ``(2, m)``."""
    edge = np.roll(corners, -1, axis=1) - corners
    normal = np.array([edge[1], -edge[0]]) / np.linalg.norm(edge, axis=0)
    level = (normal * corners).sum(axis=0)
    return np.max([n @ flat - c for n, c in zip(normal.T, level, strict=True)], axis=0)


def pinned_lug():
    return lug({"bearing": newtons(*PIN.tolist())}, pin_cards)


def remote_lug():
    point = (3.0, 25.0, 35.0)
    loads = {"force": newtons(*FORCE.tolist()), "point": [f"{v!r} mm" for v in point]}
    return lug(loads, lambda space, wall: remote_cards(space, wall, point))


def remote_cards(space, facets, point):
    """A reference node whose force CalculiX distributes over a surface."""
    node = space.node_count + 1
    owners, sides, _ = facet_owners(space, facets)
    return [
        "*NODE, NSET=REMOTE",
        ", ".join(map(str, (node, *point))),
        "*SURFACE, NAME=LOADED, TYPE=ELEMENT",
        *(f"{e + 1}, S{FACES[s]}" for e, s in zip(owners, sides, strict=True)),
        f"*COUPLING, REF NODE={node}, SURFACE=LOADED, CONSTRAINT NAME=SOFT",
        "*DISTRIBUTING",
        "1, 6",
    ], ["*CLOAD, OP=NEW", *(f"{node}, {c + 1}, {FORCE[c]}" for c in range(3))]


def pin_cards(space, facets):
    """The cosine pressure of a pin at the middle of each facet: p0 = 2 F / (pi r l)."""
    middle = space.mesh.points[:2, facets].mean(axis=2)
    cosine = PIN[:2] @ middle / np.linalg.norm(PIN) / np.linalg.norm(middle, axis=0)
    pressure = 2.0 * np.linalg.norm(PIN) / (np.pi * RADIUS * THICK) * np.maximum(cosine, 0.0)
    owners, sides, _ = facet_owners(space, facets)
    rows = zip(owners, sides, pressure, strict=True)
    return [], ["*DLOAD, OP=NEW", *(f"{e + 1}, P{FACES[s]}, {p:.9e}" for e, s, p in rows if p)]


MODELS = {
    "plate, remote": lambda: plate((110.0, 22.0, 40.0)),
    "lug, remote": remote_lug,
    "lug, bearing": pinned_lug,
}


@pytest.fixture(scope="module", params=MODELS)
def loaded_body(request):
    """A body with its load case, our solution, and its cards for CalculiX."""
    space, loaded, held, loads, cards = MODELS[request.param]()
    facets = {"loaded": loaded, "held": held}
    regions = {
        name: region(name, space.nodes.T[facet_nodes(space, own)[:3].T])
        for name, own in facets.items()
    }
    if "bearing" in loads:
        bore = Bore(axis=np.array([0.0, 0.0, 1.0]), point=np.zeros(3))
        regions["loaded"] = replace(regions["loaded"], bore=bore)
    case = load_case("loaded", [("held", "xyz")], [("loaded", loads)])
    (part,) = case_loads(space, [case], regions, facets)
    vector = LoadVector(name=part.name, supports=part.supports, force=part.force)
    (solution,) = solve_elastic(space, uniform(space, YOUNG, POISSON), [vector])
    return LoadedBody(
        name=request.param, space=space, facets=facets, regions=regions, case=case, part=part,
        solution=solution, cards=cards,
    )  # fmt: skip


def measured(body, displacement, reaction):
    """What `RECORDED` holds of a solution ``(3, n)``."""
    at = np.unique(facet_nodes(body.space, body.facets["held"]))
    arms = body.space.nodes[:, at]
    return np.array(
        [
            mean_on(body.space, body.facets["loaded"], displacement),
            reaction[:, at].sum(axis=1),
            np.cross(arms, reaction[:, at], axis=0).sum(axis=1),
        ]
    )


def in_calculix(folder, body):
    """Displacements and forces of supports, ``(3, n)`` both."""
    deck = folder / "loaded.inp"
    part = body.part
    step = ModelStep(name=part.name, supports=part.supports, force=part.force, displacement=0.0)
    stiffness = uniform(body.space, YOUNG, POISSON)
    write_calculix(
        deck,
        AnalysedModel(
            name=body.name,
            title=[body.name],
            space=body.space,
            stiffness=stiffness,
            steps=[step],
        ),
    )
    lines = deck.read_text(encoding="utf-8").splitlines()
    start, load = lines.index("*STEP"), lines.index("*CLOAD, OP=NEW")
    output = next(k for k in range(load + 1, len(lines)) if lines[k].startswith("*"))
    model, acting = body.cards
    lines = [*lines[:start], *model, *lines[start:load], *acting, *lines[output:]]
    deck.write_text("\n".join(lines) + "\n", encoding="utf-8")
    fields = run_calculix(deck)
    return (fields[name][0].T[:, : body.space.node_count] for name in ("DISP", "FORC"))


def off(found, expected):
    """Lengths of the differences of vectors ``(k, 3)`` over those expected."""
    return np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)


def test_displacements_and_reactions_are_calculixs(loaded_body):
    own = measured(loaded_body, loaded_body.solution.displacement, loaded_body.solution.reaction)
    # The pressure of a pin that is even on each facet of 5 degrees misses 0.2 % of the moment.
    assert off(own, RECORDED[loaded_body.name]).max() < 5e-3


@needs_ccx
def test_calculix_still_says_so_at_every_node(loaded_body, tmp_path):
    u, reaction = in_calculix(tmp_path, loaded_body)
    assert off(measured(loaded_body, u, reaction), RECORDED[loaded_body.name]).max() < 1e-4
    apart = np.abs(loaded_body.solution.displacement - u).max()
    assert apart < 5e-3 * np.abs(u).max()


def test_the_finite_cells_move_as_in_calculix(loaded_body):
    """On elements of 4 mm, which like the tetrahedra are 0.3 to 0.9 % below their own limit."""
    lower, upper = loaded_body.space.nodes.min(axis=1), loaded_body.space.nodes.max(axis=1)
    field = box_field(lower, upper) if loaded_body.name.startswith("plate") else lug_field
    metal = replace(STEEL, youngs_modulus=YOUNG, poissons_ratio=POISSON)
    solid = problem(field, lower, upper, [loaded_body.case], loaded_body.regions, metal)
    found = analyse(solid, 4.0).mean_displacement("loaded", "loaded")
    assert off(found[None], RECORDED[loaded_body.name][:1]).max() < 5e-3
