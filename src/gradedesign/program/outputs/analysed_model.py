"""A linear static analysis that a run solved, as other programs can solve it again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import AnisotropicStiffness, IsotropicStiffness
from gradedesign.mechanics.fe.supports import Supports


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModelStep:
    """One load case.

    Attributes
    ----------
    supports : Supports
        ``fixed`` and ``value``, mm, of every node ``(3, n)``.
    force : (3, n) array, N
        Of loads and inertia, without thermal ones.
    temperature_change : float, K
    displacement : float, mm
        Largest displacement of a node in the run.
    """

    name: str
    supports: Supports
    force: FloatArray
    displacement: float
    temperature_change: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AnalysedModel:
    """Model of one analysis.

    Attributes
    ----------
    name : str
        ``solid``, ``homogenised`` or ``explicit``.
    title : sequence of str
        What it is, one line each.
    space : TetSpace
        ``nodes`` (3, n) mm and ``elements`` (4 or 10, m): corners, then edges 01, 12, 02, 03, 13,
        23.
    stiffness : IsotropicStiffness or AnisotropicStiffness
        Of every element: ``E`` (m,) MPa and ``nu``, or ``C`` (6, 6, m) MPa in Voigt order.
    thermal_expansion : float, 1/K
    node_sets : mapping of str to (k,) int array
        Nodes by region.
    off : float
        Largest difference of displacements from those of the run, over the largest displacement,
        where the run varies the stiffness inside elements and this model does not; else 0.
    """

    name: str
    title: Sequence[str]
    space: TetSpace
    stiffness: IsotropicStiffness | AnisotropicStiffness
    steps: Sequence[ModelStep]
    thermal_expansion: float = 0.0
    node_sets: Mapping[str, IntArray] = field(default_factory=dict)
    off: float = 0.0
