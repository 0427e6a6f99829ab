"""Scaling laws of gyroid, diamond and primitive cells: thesis and literature."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

from gradedesign import LawOrigin, ScalingLaw, cubic_law, power_law

THESIS = "E. A. Ramirez Salazar, thesis, Univ. Grenoble Alpes 2022 (NNT 2022GRALI077)"


def scaling_laws() -> Iterator[ScalingLaw]:
    """Every law of this distribution."""
    yield from _thesis_laws()
    yield from _literature_laws()
    yield from _network_laws()


def _sheets(surface: str) -> tuple[str, ...]:
    """Families of thin-walled cells: published laws seldom say how the wall was made."""
    return (f"{surface}-sheet", f"{surface}-wall")


class _ThesisRow(NamedTuple):
    """One row of the thesis' tables 4.1 and 4.2."""

    name: str
    surface: str
    window: tuple[float, float]
    c1: float
    n1: float
    c3: float
    n3: float
    c2: float
    n2: float
    test: str


_BLOCK = (
    "SHELL181, block of 4x4x4 cells under compression and shear, wall 2 to 10 mm in cells of "
    "50 mm, nu 0.3"
)
_CELL = (
    "SHELL181, one cell whose lateral mean strain is pinned (so E leans towards C11), wall 2 to "
    "10 mm in cells of 50 mm, nu 0.3"
)

_THESIS = (
    _ThesisRow(
        "gyroid-4x4x4", "gyroid", (0.125, 0.624),
        0.402, 1.176, 0.426, 1.537, 0.118, 1.213, _BLOCK,
    ),
    _ThesisRow(
        "gyroid-uc", "gyroid", (0.124, 0.619),
        0.413, 1.351, 0.432, 1.679, 0.195, 1.237, _CELL,
    ),
    _ThesisRow(
        "primitive-4x4x4", "primitive", (0.095, 0.473),
        0.371, 1.415, 0.289, 1.225, 0.120, 1.223, _BLOCK,
    ),
    _ThesisRow(
        "primitive-uc", "primitive", (0.094, 0.471),
        0.478, 1.190, 0.487, 1.135, 0.206, 1.110, _CELL,
    ),
)  # fmt: skip


def _thesis_laws() -> Iterator[ScalingLaw]:
    """Tables 4.1 and 4.2; densities there are wall thickness times area of the surface."""
    for row in _THESIS:
        yield power_law(
            f"ramirez-2022-{row.name}",
            _sheets(row.surface),
            youngs=(row.c1, row.n1),
            strength=(row.c3, row.n3),
            shear=(row.c2, row.n2),
            window=row.window,
            origin=LawOrigin(kind="fe", source=f"{THESIS}, tables 4.1 and 4.2", test=row.test),
        )


class _LiteratureRow(NamedTuple):
    """One row of the thesis' table 1.5."""

    name: str
    surface: str
    kind: Literal["fe", "experiment"]
    window: tuple[float, float]
    c1: float
    n1: float
    c3: float | None
    n3: float | None
    c2: float | None
    n2: float | None
    citation: str


_LITERATURE = (
    _LiteratureRow("abueidda-2016-primitive", "primitive", "fe", (0.02, 0.20),
                   0.562, 1.519, None, None, 0.16, 0.974, "Abueidda et al. 2016"),
    _LiteratureRow("lee-2017-primitive", "primitive", "fe", (0.10, 0.24),
                   0.61, 1.57, 0.794, 1.36, 0.16, 0.97, "Lee et al. 2017"),
    _LiteratureRow("abueidda-2016-gyroid", "gyroid", "fe", (0.02, 0.20),
                   0.555, 1.406, None, None, 0.305, 1.531, "Abueidda et al. 2016"),
    _LiteratureRow("al-ketan-2018a-gyroid", "gyroid", "fe", (0.10, 0.25),
                   0.51, 1.38, 0.44, 1.24, None, None, "Al-Ketan et al. 2018a"),
    _LiteratureRow("bobbert-primitive", "primitive", "experiment", (0.23, 0.50),
                   0.107, 1.12, 0.967, 1.77, None, None, "Bobbert et al., Ti-6Al-4V cylinders"),
    _LiteratureRow("abueidda-2017-primitive", "primitive", "experiment", (0.048, 0.235),
                   0.395, 1.518, 1.104, 1.749, None, None, "Abueidda et al. 2017"),
    _LiteratureRow("al-ketan-2018b-primitive", "primitive", "experiment", (0.073, 0.206),
                   0.109, 1.31, 1.419, 1.77, None, None, "Al-Ketan et al. 2018b"),
    _LiteratureRow("zhang-2018-primitive", "primitive", "experiment", (0.104, 0.182),
                   0.56, 1.89, 2.67, 2.23, None, None, "Zhang et al. 2018"),
    _LiteratureRow("bobbert-gyroid", "gyroid", "experiment", (0.31, 0.49),
                   0.112, 1.10, 1.235, 2.09, None, None, "Bobbert et al., Ti-6Al-4V cylinders"),
    _LiteratureRow("abueidda-2019-gyroid", "gyroid", "experiment", (0.07, 0.46),
                   0.525, 1.39, 1.125, 1.63, None, None, "Abueidda et al. 2019"),
    _LiteratureRow("al-ketan-2018b-gyroid", "gyroid", "experiment", (0.121, 0.232),
                   0.103, 1.23, 0.885, 1.43, None, None, "Al-Ketan et al. 2018b"),
    _LiteratureRow("zhang-2018-gyroid", "gyroid", "experiment", (0.141, 0.244),
                   1.14, 2.23, 2.74, 2.10, None, None, "Zhang et al. 2018"),
)  # fmt: skip


def _pair(factor: float | None, exponent: float | None) -> tuple[float, float] | None:
    """Coefficients of a power; None where the source states none."""
    return None if factor is None or exponent is None else (factor, exponent)


def _literature_laws() -> Iterator[ScalingLaw]:
    """Table 1.5; some give no strength."""
    for row in _LITERATURE:
        simulated = row.kind == "fe"
        yield power_law(
            row.name,
            _sheets(row.surface),
            youngs=(row.c1, row.n1),
            strength=_pair(row.c3, row.n3),
            shear=_pair(row.c2, row.n2),
            window=row.window,
            origin=LawOrigin(
                kind=row.kind,
                source=f"{row.citation}, as quoted in {THESIS}, table 1.5",
                test="finite elements, one cell"
                if simulated
                else "compression of printed specimens",
            ),
        )


_STRENGTH_DENSITIES = (0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45, 0.50)
_NETWORK_TEST = (
    "periodic voxel finite elements, extrapolated from 32 and 64 and checked at 96 voxels per "
    "cell to 0.6 %, nu 0.3; strength from the 99th percentile of von Mises stress under uniaxial "
    "stress along a cell axis; moduli fitted over 0.2 to 0.5 (E is 3 to 4 % high at 0.15)"
)


def _network_laws() -> Iterator[ScalingLaw]:
    """Converged homogenisation of the network cells (project voxlat)."""
    yield cubic_law(
        "voxlat-gyroid-network",
        ("gyroid-network",),
        youngs=(0.902, 2.126),
        bulk=(0.464, 1.542),
        shear=(0.348, 1.746),
        strength=(
            _STRENGTH_DENSITIES,
            tuple(1 / k for k in (54.0, 36.0, 26.0, 19.0, 15.0, 12.0, 10.0, 8.3)),
        ),
        window=(0.15, 0.50),
        origin=LawOrigin(kind="computed", source="voxlat, gyroid network", test=_NETWORK_TEST),
    )
    yield cubic_law(
        "voxlat-diamond-network",
        ("diamond-network",),
        youngs=(0.671, 1.934),
        bulk=(0.500, 1.645),
        shear=(0.372, 1.655),
        strength=(
            _STRENGTH_DENSITIES,
            tuple(1 / k for k in (38.0, 23.0, 16.0, 12.0, 9.7, 8.2, 7.1, 6.2)),
        ),
        window=(0.15, 0.50),
        origin=LawOrigin(kind="computed", source="voxlat, diamond network", test=_NETWORK_TEST),
    )
