"""The part as a homogenised solid: stiffness from density, and what follows from it.

Every tetrahedron holds a share ``solid_share`` of fully dense material (skin, kept regions) and
the lattice in the rest. The two phases act in parallel (Voigt), which is exact for a skin loaded
in its plane; what it misses elsewhere is part of the gap that the correction measures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.fe.assembly import AssemblyPattern, assembly_pattern
from gradedesign.fe.load_case import PartLoadCase
from gradedesign.fe.loads import body_force, thermal_force
from gradedesign.fe.solution import LoadVector, Solution
from gradedesign.fe.solve import ElasticSystem, prepare_elastic, solve_cases
from gradedesign.fe.space import TetSpace
from gradedesign.fe.stiffness import AnisotropicStiffness, PointStiffness, Stiffness
from gradedesign.material.material import Material
from gradedesign.material.scaling_law import ScalingLaw, isotropic_stiffness
from gradedesign.mesh.tet_mesh import signed_volumes
from gradedesign.sizing.local_factor import LocalFactor
from gradedesign.sizing.local_fill import LocalFill
from gradedesign.sizing.wall_factors import WallFactors

#: Residual of the homogenised solves: sizing needs no more, and balance is checked to it.
RTOL = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HomogenisedModel:
    """A part whose tetrahedra carry a lattice of given density.

    Attributes
    ----------
    space : TetSpace
        Quadratic tetrahedra of the part.
    volumes : (M,) array, mm^3
    solid_share : (M,) array
        Share of each tetrahedron that stays fully dense, 0 to 1.
    material : Material
    law : ScalingLaw
    rotation : (6, 6) or (6, 6, M) array
        Bond matrix that takes the law's stiffness from cell axes to global axes: one, or one for
        each tetrahedron.
    cases : tuple of PartLoadCase
    pattern : AssemblyPattern
        Of the space, found once.
    stiffness_factor : float
        Correction of the law's stiffness from explicit analyses; 1 at first.
    stiffness_exponent : float
        The factor holds at ``reference_density`` and grows with this power of density.
    reference_density : float
    fill : LocalFill or None
        Density that the trimmed cells really hold; None: the one asked for.
    few_cells : LocalFactor or None
        What few cells across the part keep of the law's stiffness; None: all of it.
    walls : WallFactors or None
        How the stiffness varies over walls of few cells; None: not at all.
    """

    space: TetSpace
    volumes: FloatArray
    solid_share: FloatArray
    material: Material
    law: ScalingLaw
    rotation: FloatArray
    cases: tuple[PartLoadCase, ...]
    pattern: AssemblyPattern
    stiffness_factor: float = 1.0
    stiffness_exponent: float = 0.0
    reference_density: float = 1.0
    fill: LocalFill | None = None
    few_cells: LocalFactor | None = None
    walls: WallFactors | None = None

    def __post_init__(self) -> None:
        count = self.space.elements.shape[1]
        object.__setattr__(self, "volumes", locked(self.volumes, (count,), name="volumes"))
        object.__setattr__(
            self, "solid_share", locked(self.solid_share, (count,), name="solid_share")
        )
        bond = (6, 6) if np.ndim(self.rotation) == 2 else (6, 6, count)
        object.__setattr__(self, "rotation", locked(self.rotation, bond, name="rotation"))


def homogenised_model(
    space: TetSpace,
    solid_share: FloatArray,
    material: Material,
    law: ScalingLaw,
    cases: Sequence[PartLoadCase],
    *,
    rotation: FloatArray | None = None,
    stiffness_factor: float = 1.0,
) -> HomogenisedModel:
    """Build a model; columns of ``rotation``, (3, 3) or (3, 3, M), are the cell axes."""
    return HomogenisedModel(
        space=space,
        volumes=signed_volumes(space.mesh),
        solid_share=solid_share,
        material=material,
        law=law,
        rotation=bond_matrix(np.eye(3) if rotation is None else rotation),
        cases=tuple(cases),
        pattern=assembly_pattern(space),
        stiffness_factor=stiffness_factor,
    )


def bond_matrix(rotation: FloatArray) -> FloatArray:
    """Stress transformation of Voigt vectors, ``(6, 6, ...)``, so that ``C' = M C M^T``.

    Parameters
    ----------
    rotation : (3, 3, ...) array
        Takes cell components to global ones, ``x' = R x``.

    References
    ----------
    W. L. Bond, Proc. Phys. Soc. 1943.
    """
    pairs = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
    r = np.asarray(rotation, dtype=np.float64)
    m = np.zeros((6, 6, *r.shape[2:]))
    for a, (i, j) in enumerate(pairs):
        for b, (p, q) in enumerate(pairs):
            m[a, b] = r[i, p] * r[j, q] if p == q else r[i, p] * r[j, q] + r[i, q] * r[j, p]
    return m


def solid_stiffness(model: HomogenisedModel) -> FloatArray:
    """Stiffness of the base material, ``(6, 6)``, MPa."""
    return isotropic_stiffness(
        np.asarray(model.material.youngs_modulus), model.material.poissons_ratio
    )


def cell_stiffness(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Corrected stiffness of the endless lattice in global axes, ``(6, 6, M)``, MPa.

    What local stress follows from: a member in a face of a wall is strained as the wall is there.
    """
    scale = model.material.youngs_modulus * correction_factor(model, rho)
    return scale * _rotated(model, _law_stiffness(model, held_density(model, rho)))


def lattice_stiffness(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Corrected stiffness of the lattice phase in global axes, MPa.

    Returns
    -------
    (6, 6, M) or (6, 6, q, M) array
        The latter at the points of the walls' rule, where the model has walls.
    """
    if model.walls is None:
        return cell_stiffness(model, rho)
    scale = model.material.youngs_modulus * correction_factor(model, rho)
    D = model.walls.scale(rho)
    whole = _law_stiffness(model, held_density(model, rho))
    return scale * _rotated(model, D[:, None] * whole[:, :, None] * D[None])


def lattice_stiffness_derivative(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """d(lattice stiffness)/d(rho), shaped as `lattice_stiffness`, MPa."""
    scale = model.material.youngs_modulus * correction_factor(model, rho)
    held = held_density(model, rho)
    slope = _law_slope(model, held) * held_slope(model, rho)
    if model.stiffness_exponent:
        slope = slope + model.stiffness_exponent / rho * _law_stiffness(model, held)
    if model.few_cells is not None:
        # The factor itself is part of the scale.
        relative = model.few_cells.slope(rho) / model.few_cells.at(rho)
        slope = slope + relative * _law_stiffness(model, held)
    if model.walls is not None:
        D = model.walls.scale(rho)
        grown = 0.5 * model.walls.log_slope(rho)
        whole = _law_stiffness(model, held)[:, :, None]
        slope = slope[:, :, None] + (grown[:, None] + grown[None]) * whole
        slope = D[:, None] * slope * D[None]
    return scale * _rotated(model, slope)


def as_stiffness(model: HomogenisedModel, C: FloatArray) -> Stiffness:
    """Matrices of every tetrahedron, or at the points of the walls' rule, for assembly."""
    if model.walls is None:
        return AnisotropicStiffness(C=C)
    return PointStiffness(C=C, points=model.walls.points, weights=model.walls.weights)


def held_density(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Density that the lattice really holds where ``rho`` is asked for, ``(M,)``."""
    return rho if model.fill is None else model.fill.at(rho)


def held_slope(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """d(density held)/d(density asked for), ``(M,)``."""
    return np.ones_like(rho) if model.fill is None else model.fill.slope(rho)


def _law_stiffness(model: HomogenisedModel, held: FloatArray) -> FloatArray:
    """Stiffness of the law, in proportion to the solid beyond the ends of its window.

    Only densities held at the faces of a part leave the window; what is asked for never does.
    """
    if model.fill is None:
        return model.law.stiffness(held)
    inside = np.clip(held, *model.law.window)
    return model.law.stiffness(inside) * (held / inside)


def _law_slope(model: HomogenisedModel, held: FloatArray) -> FloatArray:
    """Derivative of `_law_stiffness` by the density held."""
    if model.fill is None:
        return model.law.stiffness_derivative(held)
    inside = np.clip(held, *model.law.window)
    return np.where(
        inside == held,
        model.law.stiffness_derivative(inside),
        model.law.stiffness(inside) / inside,
    )


def correction_factor(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """What few cells keep of the lattice's stiffness, and explicit analyses taught, ``(M,)``."""
    grown = (rho / model.reference_density) ** model.stiffness_exponent
    few = 1.0 if model.few_cells is None else model.few_cells.at(rho)
    return np.asarray(model.stiffness_factor * grown * few)


def effective_stiffness(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Stiffness of both phases in parallel, shaped as `lattice_stiffness`, MPa."""
    share = model.solid_share
    lattice = (1 - share) * lattice_stiffness(model, rho)
    solid = solid_stiffness(model).reshape(6, 6, *(1,) * (lattice.ndim - 2))
    return np.asarray(lattice + share * solid)


def solid_held(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Density of the lattice phase with what faces add to it or take away, ``(M,)``."""
    held = held_density(model, rho)
    return held if model.walls is None else held * model.walls.solid(rho)


def solid_slope(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """d(solid held)/d(density asked for), ``(M,)``."""
    slope = held_slope(model, rho)
    if model.walls is None:
        return slope
    added = held_density(model, rho) * model.walls.solid_slope(rho)
    return slope * model.walls.solid(rho) + added


def mass_density(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Mass per volume of every tetrahedron, ``(M,)``, t/mm^3."""
    share = model.solid_share
    return model.material.density * (share + (1 - share) * solid_held(model, rho))


def lattice_mass(model: HomogenisedModel, rho: FloatArray) -> float:
    """Mass of the lattice phase alone, t."""
    weights = model.volumes * (1 - model.solid_share)
    return float(model.material.density * (weights @ solid_held(model, rho)))


def total_mass(model: HomogenisedModel, rho: FloatArray) -> float:
    """Mass of lattice and solid phases, t."""
    return float(model.volumes @ mass_density(model, rho))


def density_loads(model: HomogenisedModel, rho: FloatArray, case: PartLoadCase) -> FloatArray:
    """Forces that follow the design: inertia and thermal expansion, ``(3, N)``, N."""
    force = np.zeros_like(case.force)
    if np.any(case.acceleration):
        force += body_force(model.space, mass_density(model, rho), case.acceleration)
    if case.temperature_change:
        force += thermal_force(
            model.space,
            as_stiffness(model, effective_stiffness(model, rho)),
            model.material.thermal_expansion,
            case.temperature_change,
        )
    return force


def homogenised_system(model: HomogenisedModel, rho: FloatArray) -> ElasticSystem:
    """Stiffness for lattice densities ``(M,)``, ready for loads and adjoint loads alike."""
    stiffness = as_stiffness(model, effective_stiffness(model, rho))
    return prepare_elastic(model.space, stiffness, pattern=model.pattern)


def solve_homogenised(
    model: HomogenisedModel, rho: FloatArray, system: ElasticSystem | None = None
) -> tuple[Solution, ...]:
    """Displacements of every load case for lattice densities ``(M,)``.

    ``system`` is theirs by `homogenised_system`, where it is at hand.
    """
    vectors = [
        LoadVector(
            name=case.name,
            supports=case.supports,
            force=case.force + density_loads(model, rho, case),
        )
        for case in model.cases
    ]
    return solve_vectors(system or homogenised_system(model, rho), vectors)


def solve_vectors(system: ElasticSystem, vectors: Sequence[LoadVector]) -> tuple[Solution, ...]:
    """Displacements of given load vectors, such as adjoint loads, on the same stiffness."""
    return solve_cases(system, vectors, rtol=RTOL)


def _rotated(model: HomogenisedModel, relative: FloatArray) -> FloatArray:
    """Turn ``(6, 6, ..., M)`` from cell to global axes; identity costs nothing."""
    bond = model.rotation
    if bond.ndim == 3:
        half = np.einsum("aim,ij...m->aj...m", bond, relative)
        return np.einsum("aj...m,bjm->ab...m", half, bond)
    if np.array_equal(bond, np.eye(6)):
        return relative
    return np.einsum("ai,ij...,bj->ab...", bond, relative, bond)
