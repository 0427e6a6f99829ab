"""The part as a homogenised solid: its tetrahedra, material, law and cell axes.

Every tetrahedron holds a share ``solid_fraction`` of fully dense material (skin, passive regions)
and the lattice in the rest, each where it lies: a skin at the face bends as such, however thick the
tetrahedron is. Where both meet in a tetrahedron they are strained alike; what that misses is part
of the discrepancy that the correction measures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.geometry.tets.tet_mesh import signed_volumes
from gradedesign.mechanics.fe.assembly import AssemblyPattern, assembly_pattern
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.multigrid_solver import MULTIGRID
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import PAIRS, mean_of
from gradedesign.mechanics.material.bond_matrix import bond_matrix
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.scaling_law import ScalingLaw
from gradedesign.mechanics.material.void_law import VOID_DENSITY, VOID_LAW
from gradedesign.mechanics.sizing.effective_density import EffectiveDensity
from gradedesign.mechanics.sizing.wall_factors import WallFactors
from gradedesign.mechanics.solver.linear_solver import LinearSolver


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HomogenisedModel:
    """A part whose tetrahedra carry a lattice of given density."""

    space: TetSpace  #: Quadratic tetrahedra of the part.
    volumes: FloatArray  #: ``(M,)``, mm^3.
    #: ``(M,)``. Share of each tetrahedron that stays fully dense, 0 to 1.
    solid_fraction: FloatArray
    material: Material
    law: LawField
    #: ``(6, 6) or (6, 6, 4, M)``. Bond matrix that takes the law's stiffness from cell axes to
    #: global axes: one, or one at each Gauss point of every tetrahedron.
    rotation: FloatArray
    cases: tuple[PartLoadCase, ...]
    pattern: AssemblyPattern  #: Of the space, found once.
    solver: LinearSolver = MULTIGRID
    #: Correction of the law's stiffness from explicit analyses; 1 at first.
    stiffness_factor: float = 1.0
    #: The factor holds at ``reference_density`` and grows with this power of density.
    stiffness_exponent: float = 0.0
    reference_density: float = 1.0  #: Relative density.
    #: That of cells beside passive regions, by the nominal one; None: they are the same.
    effective: EffectiveDensity | None = None
    #: How the stiffness varies over walls of few cells; None: not at all.
    walls: WallFactors | None = None
    #: ``(M,)``. Critical stress against buckling over that of the periodic lattice, for cells that
    #: free faces cut; None: 1 everywhere.
    cut_share: FloatArray | None = None
    #: ``(10, M)``. Where the solid lies: means of its indicator with pairs of barycentric
    #: coordinates, in the order of `gradedesign.mechanics.fe.stiffness.PAIRS`. None: evenly in
    #: every tetrahedron.
    solid_moments: FloatArray | None = None
    #: ``(M,)``. Share of each tetrahedron that is solid members, among ``solid_fraction``; None:
    #: none is.
    member_fraction: FloatArray | None = None

    def __post_init__(self) -> None:
        count = self.space.elements.shape[1]
        object.__setattr__(self, "volumes", locked(self.volumes, (count,), name="volumes"))
        object.__setattr__(
            self, "solid_fraction", locked(self.solid_fraction, (count,), name="solid_fraction")
        )
        if self.cut_share is not None:
            object.__setattr__(
                self, "cut_share", locked(self.cut_share, (count,), name="cut_share")
            )
        if self.solid_moments is not None:
            moments = locked(self.solid_moments, (len(PAIRS), count), name="solid_moments")
            object.__setattr__(self, "solid_moments", moments)
            if np.abs(mean_of(moments) - self.solid_fraction).max(initial=0.0) > 1e-6:
                raise ValueError("moments of the solid have other means than its volume fractions")
        bond = (6, 6) if np.ndim(self.rotation) == 2 else (6, 6, 4, count)
        object.__setattr__(self, "rotation", locked(self.rotation, bond, name="rotation"))
        if self.walls is not None and self.rotation.ndim == 4:
            raise ValueError("walls lie along the axes of the cells: expected one rotation for all")

    @property
    def lattice_volumes(self) -> FloatArray:
        """Volume of each tetrahedron that is lattice, not solid, ``(M,)``, mm^3."""
        return np.asarray(self.volumes * (1 - self.solid_fraction))


def filter_weights(model: HomogenisedModel) -> FloatArray:
    """Weights of tetrahedra in filters, ``(M,)``, mm^3: their lattice, and hardly any for solid."""
    return np.asarray(model.volumes * np.maximum(1 - model.solid_fraction, 1e-6))


def homogenised_model(
    space: TetSpace,
    solid_fraction: FloatArray,
    material: Material,
    law: ScalingLaw | LawField,
    cases: Sequence[PartLoadCase],
    *,
    rotation: FloatArray | None = None,
    solver: LinearSolver = MULTIGRID,
    solid_moments: FloatArray | None = None,
) -> HomogenisedModel:
    """Build a model; columns of ``rotation``, (3, 3) or (3, 3, 4, M), are the cell axes.

    ``solid_moments`` are not held where every tetrahedron is all solid or all lattice.
    """
    whole = np.all((solid_fraction <= 0.0) | (solid_fraction >= 1.0))
    return HomogenisedModel(
        space=space,
        volumes=signed_volumes(space.mesh),
        solid_fraction=solid_fraction,
        material=material,
        law=law if isinstance(law, LawField) else LawField(laws=(law,)),
        rotation=bond_matrix(np.eye(3) if rotation is None else rotation),
        cases=tuple(cases),
        pattern=assembly_pattern(space),
        solver=solver,
        solid_moments=None if whole else solid_moments,
    )


def built_density(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Densities as they are built, ``(M,)``: none where void stands for lattice."""
    void = all(law is VOID_LAW for law in model.law.laws)
    return np.zeros_like(rho) if void else rho


def with_void(model: HomogenisedModel, bounds: tuple[float, float]) -> HomogenisedModel:
    """The model with void for all lattice, whatever its density between the bounds is."""
    count = model.volumes.size
    held = np.outer(np.array(bounds) * (VOID_DENSITY / bounds[1]), np.ones(count))
    return replace(model, effective=EffectiveDensity(nominal=np.array(bounds), effective=held))


def effective_density(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Effective density of the lattice where ``rho`` is nominal, ``(M,)``."""
    return rho if model.effective is None else model.effective.at(rho)


def nominal_density(model: HomogenisedModel, effective: FloatArray) -> FloatArray:
    """Nominal density of cells that hold an effective density, ``(M,)``."""
    return effective if model.effective is None else model.effective.nominal_for(effective)


def effective_slope(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Derivative of effective by nominal density, ``(M,)``."""
    return np.ones_like(rho) if model.effective is None else model.effective.slope(rho)
