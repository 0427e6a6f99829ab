"""``gradedesign check``: what a run would do, in seconds once its laws are in the cache."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gradedesign.case.read_case import load_case
from gradedesign.cell.wall_size import wall_mm
from gradedesign.cli.plugins import registry_for
from gradedesign.cli.progress_lines import ProgressLines
from gradedesign.cli.show import print_json, print_table, print_text, print_warnings
from gradedesign.fe.solve import predict_memory_bytes
from gradedesign.ladder.own_cell import with_own_cell
from gradedesign.ladder.round import explicit_cube_for
from gradedesign.ladder.setup import Setup, part_volume, prepare
from gradedesign.verify.explicit_mesh import DOFS_PER_TET, TETS_PER_CUBE

#: Unknowns solved per second and round, all load cases, on two cores.
DOFS_PER_SECOND = 3e4


def check(path: Path, *, allow_outside: bool, strict_plugins: bool, as_json: bool) -> None:
    """Read, repair, select, and predict; nothing is written but the user's cache."""
    case = load_case(path, allow_outside=allow_outside)
    registry = with_own_cell(case, registry_for(strict_plugins=strict_plugins))
    # What may take minutes the first time is told beside the answer.
    with ProgressLines("check", err=True) as progress:
        setup = prepare(case, registry, progress)
        data = describe(setup)
    if as_json:
        print_json(data)
        return
    print_text(f"case {case.name}: the part holds {data['part']['volume_mm3']:.6g} mm^3")
    repairs = data["part"]["repairs"]
    print_text("repairs: " + (", ".join(f"{k} {v}" for k, v in repairs.items()) or "none"))
    print_table(
        "Regions",
        ("region", "faces", "area mm^2", "centroid mm"),
        [
            (r["name"], str(r["faces"]), f"{r['area_mm2']:.4g}", str(r["centroid_mm"]))
            for r in data["regions"]
        ],
    )
    print_text("free rigid motions: none")
    p = data["prediction"]
    print_text(
        f"cell {data['cell']}, law {data['law']}, density {p['density'][0]:.3g} to "
        f"{p['density'][1]:.3g}, thinnest wall {p['thinnest_wall_mm']:.3g} mm",
        hang=2,
    )
    print_text(
        f"part: {p['part_dofs']} unknowns; explicit lattice at a grid of {p['cube_mm']:.3g} mm: "
        f"about {p['explicit_dofs'] / 1e6:.2g} M unknowns, {p['memory_GB']:.2g} GB, "
        f"{p['seconds_per_round']:.0f} s per round",
        hang=2,
    )
    print_warnings(setup.warnings)


def describe(setup: Setup) -> dict[str, Any]:
    """Plain data of a prepared case; the explicit size is predicted at a third of the window."""
    case = setup.case
    low, high = setup.bounds
    stated = case.lattice.wall
    wall = stated or float(wall_mm(setup.family, setup.parameters, low, setup.layout.least))
    cube = explicit_cube_for(setup, wall)
    guess = low + (high - low) / 3
    share = setup.model.solid_share
    solid = float(setup.model.volumes @ (share + (1 - share) * guess))
    dofs = TETS_PER_CUBE * solid / cube**3 * DOFS_PER_TET
    report = setup.part.report
    return {
        "case": case.name,
        "cell": setup.family.name,
        "law": setup.law.name,
        "part": {
            "volume_mm3": part_volume(setup),
            "repairs": {
                key: value
                for key in (
                    "vertices_welded",
                    "degenerate_removed",
                    "duplicates_removed",
                    "facets_flipped",
                    "shells_inverted",
                    "shells_ignored",
                    "shells_united",
                    "fragments_dropped",
                    "holes_filled",
                )
                if (value := getattr(report, key))
            },
        },
        "regions": [
            {
                "name": name,
                "faces": len(region.faces),
                "area_mm2": region.area,
                "centroid_mm": [round(float(c), 3) for c in np.asarray(region.centroid)],
            }
            for name, region in sorted(setup.part.regions.items())
        ],
        "limits": stated_limits(setup),
        "free_rigid_motions": [],
        "prediction": {
            "density": list(setup.bounds),
            "thinnest_wall_mm": wall,
            "cube_mm": cube,
            "part_dofs": setup.space.dof_count,
            "explicit_dofs": int(dofs),
            "memory_GB": predict_memory_bytes(int(dofs), 2) / 1e9,
            "seconds_per_round": dofs / DOFS_PER_SECOND,
        },
        "warnings": list(setup.warnings),
    }


def stated_limits(setup: Setup) -> list[dict[str, str]]:
    """Limits as the case states them; those relative to the solid part are not in mm yet."""
    rows = [
        {
            "name": f"displacement of {limit.name}",
            "load_case": limit.load_case,
            "allowed": limit.stated or f"{limit.limit:g} mm",
        }
        for limit in setup.displacement_limits
    ]
    if setup.stress_limit is not None:
        rows.append(
            {"name": "stress", "load_case": "every", "allowed": f"{setup.stress_limit:.4g} MPa"}
        )
    return rows
