"""The record of a cell's computed properties over relative density, and its plain file form."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, locked
from gradedesign.common.values.shown_record import ShownRecord, frame_of
from gradedesign.errors import PluginError
from gradedesign.mechanics.material.buckling_table import (
    BucklingTable,
    buckling_entry,
    buckling_from_entry,
)
from gradedesign.mechanics.material.strength_surface import StrengthSurface

#: Changes whenever a table written by an older version could not be read as it was meant.
FORMAT = 1

#: Moduli of the columns of `PropertyTable.to_frame`, in the order of Voigt.
_MODULI = ("E_x", "E_y", "E_z", "G_yz", "G_xz", "G_xy")
_UPPER = np.triu_indices(6)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class PropertyTable(ShownRecord):
    """Effective stiffness and strength of one cell at some densities.

    Attributes
    ----------
    name : str
        Of the law made from it: ``<family>-computed``.
    parameters : mapping of str to float
        Complete.
    symmetry : str
        ``cubic``, ``tetragonal``, ``orthotropic`` or ``none``.
    poissons_ratio : float
        Of the base material.
    density : (k,) array
        Increasing.
    stiffness : (k, 6, 6) array
        Over the base material's Young's modulus, Voigt order xx, yy, zz, yz, xz, xy with
        engineering shear, in the cell's axes; extrapolated to no voxels.
    stiffness_error : (k,) array
        Norm of the extrapolation over that of the stiffness.
    uncertainty : (k, 6, 6) array or None
        Of each entry of the stiffness, in its unit: what the extrapolation added to it, or its
        departure from the declared symmetry where that is larger. None in tables of before.
    strength : (k,) array
        Macroscopic von Mises stress at which the percentile of the local one reaches the base
        material's strength, over that strength, in the worst direction.
    strength_error : (k,) array
        Relative change from half the resolution.
    factors : mapping of str to (k,) array
        Local over macroscopic von Mises stress for each class of directions, and over the
        hydrostatic stress for ``hydrostatic``.
    surfaces : tuple of StrengthSurface
        Local stress under any macroscopic stress, one for each density, or none.
    resolution : (k,) array
        Voxels along each edge of the cell; the second grid has half of them.
    percentile : float
        By volume, of the local von Mises stress.
    buckling : BucklingTable or None
        Critical stresses, at densities of their own; None where they were not computed.
    method, version, date : str
        Provenance: how, with which version of gradedesign and when it was computed.
    """

    name: str
    family: str
    parameters: Mapping[str, float]
    symmetry: str
    poissons_ratio: float
    density: FloatArray
    stiffness: FloatArray
    stiffness_error: FloatArray
    strength: FloatArray
    strength_error: FloatArray
    resolution: IntArray
    percentile: float
    method: str
    version: str
    date: str
    factors: Mapping[str, FloatArray] = field(default_factory=dict)
    surfaces: tuple[StrengthSurface, ...] = ()
    buckling: BucklingTable | None = None
    uncertainty: FloatArray | None = None

    def __post_init__(self) -> None:
        k = np.asarray(self.density).size
        for key, shape in (
            ("density", (k,)),
            ("stiffness", (k, 6, 6)),
            ("stiffness_error", (k,)),
            ("strength", (k,)),
            ("strength_error", (k,)),
        ):
            object.__setattr__(self, key, locked(getattr(self, key), shape, name=key))
        if self.uncertainty is not None:
            each = locked(self.uncertainty, (k, 6, 6), name="uncertainty")
            if not (each >= 0).all():
                raise ValueError(f"property table '{self.name}' has a negative uncertainty, or NaN")
            object.__setattr__(self, "uncertainty", each)
        whole = locked(self.resolution, (k,), dtype=np.int64, name="resolution")
        object.__setattr__(self, "resolution", whole)
        factors = {n: locked(v, (k,), name=n) for n, v in self.factors.items()}
        object.__setattr__(self, "factors", MappingProxyType(factors))
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))
        if len(self.surfaces) not in (0, k):
            raise ValueError(
                f"property table '{self.name}' has {len(self.surfaces)} strength surfaces for {k} "
                f"densities; expected one for each, or none"
            )
        if k < 2 or (np.diff(self.density) <= 0).any() or not self.density[0] > 0:
            raise ValueError(
                f"property table '{self.name}' needs two or more increasing positive densities, "
                f"found {self.density.tolist()}"
            )

    def to_frame(self) -> Any:
        """Stiffness and strength over the base material's by density, as a pandas ``DataFrame``.

        ``E_x`` to ``nu_xy`` follow from the stiffness: moduli along the axes of the cell.

        Raises
        ------
        CaseError
            If pandas is not installed.
        """
        compliance = np.linalg.inv(self.stiffness)
        moduli = 1.0 / np.diagonal(compliance, axis1=1, axis2=2)
        columns = {"density": self.density, **dict(zip(_MODULI, moduli.T, strict=True))}
        columns |= {"nu_xy": -compliance[:, 0, 1] * moduli[:, 0], "strength": self.strength}
        columns |= {name: getattr(self, name) for name in ("stiffness_error", "strength_error")}
        columns |= {"resolution": self.resolution}
        columns |= {f"factor {name}": values for name, values in self.factors.items()}
        numbers = range(self.density.size)
        rows = [{name: values[k].item() for name, values in columns.items()} for k in numbers]
        return frame_of([{"cell": self.family, **row} for row in rows])


def write_property_table(table: PropertyTable) -> str:
    """Text of a table: JSON, one line for each density.

    Examples
    --------
    >>> from gradedesign.geometry.cell.formula_cell import formula_cell
    >>> from gradedesign.geometry.cell.calibration import calibrate
    >>> family = formula_cell("p", formula="cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)")
    >>> cell = calibrate(family, resolution=32)
    >>> from gradedesign.properties import compute_table
    >>> table = compute_table(cell, densities=[0.4, 0.6], resolution=16)
    >>> read_property_table(write_property_table(table)).density.tolist()
    [0.4, 0.6]
    """
    head = {
        "gradedesign property table": FORMAT,
        "name": table.name,
        "family": table.family,
        "parameters": dict(table.parameters),
        "symmetry": table.symmetry,
        "poissons_ratio": table.poissons_ratio,
        "percentile": table.percentile,
        "method": table.method,
        "version": table.version,
        "date": table.date,
        "stiffness entries": "upper triangle by rows, over the base material's Young's modulus",
    }
    if table.uncertainty is not None:
        head["uncertainty entries"] = "as stiffness, of each entry, without sign"
    rows: list[dict[str, Any]] = [
        {
            "density": _digits(table.density[i]),
            "resolution": int(table.resolution[i]),
            "stiffness": [_digits(v) for v in table.stiffness[i][_UPPER]],
            "stiffness_error": _digits(table.stiffness_error[i], 2),
            "strength": _digits(table.strength[i], 5),
            "strength_error": _digits(table.strength_error[i], 2),
            "factors": {n: _digits(v[i], 5) for n, v in table.factors.items()},
        }
        for i in range(table.density.size)
    ]
    if table.uncertainty is not None:
        for row, each in zip(rows, table.uncertainty, strict=True):
            row["uncertainty"] = [_digits(v, 2) for v in each[_UPPER]]
    for row, surface in zip(rows, table.surfaces, strict=False):
        row["surface"] = _surface_entry(surface)
    lines = [f"  {json.dumps(k)}: {json.dumps(v)}," for k, v in head.items()]
    if table.buckling is not None:
        lines.append(f'  "buckling": {json.dumps(buckling_entry(table.buckling))},')
    body = ",\n".join("    " + json.dumps(row) for row in rows)
    return "{\n" + "\n".join(lines) + '\n  "rows": [\n' + body + "\n  ]\n}\n"


def read_property_table(text: str) -> PropertyTable:
    """Parse what `write_property_table` wrote.

    Raises
    ------
    PluginError
        If the text is no table, is damaged, or of another format version.

    Examples
    --------
    A table that `gradedesign tabulate` wrote::

        table = read_property_table(Path("my-cell.properties").read_text())
    """
    try:
        data: dict[str, Any] = json.loads(text)
        stated = data["gradedesign property table"]
    except (ValueError, KeyError, TypeError) as error:
        raise PluginError(
            f"this is no property table of gradedesign ({type(error).__name__}: {error}); "
            f"expected JSON with the key 'gradedesign property table'"
        ) from error
    if stated != FORMAT:
        raise PluginError(
            f"property table '{data.get('name')}' has format {stated!r}, this version of "
            f"gradedesign reads {FORMAT}; compute it again, or install the matching plugin"
        )
    try:
        return _table(data)
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise PluginError(
            f"property table '{data.get('name')}' is damaged ({type(error).__name__}: {error}); "
            f"compute it again, or install the plugin again"
        ) from error


def _table(data: Mapping[str, Any]) -> PropertyTable:
    """Build the record from parsed text."""
    rows = data["rows"]
    has_uncertainty = "uncertainty entries" in data
    return PropertyTable(
        name=str(data["name"]),
        family=str(data["family"]),
        parameters={str(k): float(v) for k, v in data["parameters"].items()},
        symmetry=str(data["symmetry"]),
        poissons_ratio=float(data["poissons_ratio"]),
        density=np.array([row["density"] for row in rows]),
        stiffness=np.array([_whole(row["stiffness"]) for row in rows]),
        uncertainty=np.array([_whole(row["uncertainty"]) for row in rows])
        if has_uncertainty
        else None,
        stiffness_error=np.array([row["stiffness_error"] for row in rows]),
        strength=np.array([row["strength"] for row in rows]),
        strength_error=np.array([row["strength_error"] for row in rows]),
        resolution=np.array([row["resolution"] for row in rows]),
        percentile=float(data["percentile"]),
        method=str(data["method"]),
        version=str(data["version"]),
        date=str(data["date"]),
        factors={n: np.array([row["factors"][n] for row in rows]) for n in rows[0]["factors"]},
        surfaces=tuple(_surface(row["surface"], data) for row in rows if "surface" in row),
        buckling=buckling_from_entry(data["buckling"]) if "buckling" in data else None,
    )


def _surface_entry(surface: StrengthSurface) -> dict[str, Any]:
    """Plain data of a surface; symmetry and percentile are those of the table."""
    return {
        "exponent": surface.exponent,
        "weights": [_digits(v) for v in surface.weights],
        "forms": [[_digits(v) for v in form[_UPPER]] for form in surface.forms],
        "max_error": _digits(surface.max_error, 2),
        "rms_error": _digits(surface.rms_error, 2),
        "unsafe_error": _digits(surface.unsafe_error, 2),
        "distribution": [[_digits(v, 4) for v in row] for row in surface.distribution],
    }


def _surface(entry: Mapping[str, Any], data: Mapping[str, Any]) -> StrengthSurface:
    """Record of what `_surface_entry` wrote."""
    return StrengthSurface(
        exponent=int(entry["exponent"]),
        weights=np.array(entry["weights"], dtype=np.float64),
        forms=np.array([_whole(values) for values in entry["forms"]]).reshape(-1, 6, 6),
        symmetry=str(data["symmetry"]),
        max_error=float(entry["max_error"]),
        rms_error=float(entry["rms_error"]),
        unsafe_error=float(entry["unsafe_error"]),
        percentile=float(data["percentile"]),
        distribution=np.array(entry.get("distribution", [[], []]), dtype=np.float64),
    )


def _whole(upper: Sequence[float]) -> FloatArray:
    """Symmetric matrix ``(6, 6)`` from its upper triangle by rows."""
    if len(upper) != _UPPER[0].size:
        raise ValueError(f"{len(upper)} entries of a symmetric matrix, expected {_UPPER[0].size}")
    matrix = np.zeros((6, 6))
    matrix[_UPPER] = upper
    matrix[_UPPER[::-1]] = upper
    return matrix


def _digits(value: float, digits: int = 7) -> float:
    """Round to significant digits, so that files stay short and stable."""
    return float(f"{value:.{digits}g}")
