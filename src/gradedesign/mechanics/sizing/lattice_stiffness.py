"""Stiffness of the lattice phase, and of both phases, from density.

Arrays are ``(6, 6, M)`` where cells lie alike, ``(6, 6, 4, M)`` at the Gauss points of the
tetrahedra where they follow a map, and ``(6, 6, 10, M)`` moments where walls of few cells vary over
their thickness or solid and lattice share a tetrahedron; `as_stiffness` makes of them what is
assembled.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.fe.assembly import pair_energies
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import (
    UNIFORM,
    AnisotropicStiffness,
    GaussStiffness,
    MomentStiffness,
    Stiffness,
    gauss_moments,
)
from gradedesign.mechanics.material.scaling_law import isotropic_stiffness
from gradedesign.mechanics.sizing.homogenised_model import (
    HomogenisedModel,
    effective_density,
    effective_slope,
)
from gradedesign.mechanics.sizing.members import moments_by_share


def solid_stiffness(model: HomogenisedModel) -> FloatArray:
    """Stiffness of the base material, ``(6, 6)``, MPa."""
    return isotropic_stiffness(
        np.asarray(model.material.youngs_modulus), model.material.poissons_ratio
    )


def cell_stiffness(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Corrected stiffness of the periodic lattice in global axes, ``(6, 6, [4,] M)``, MPa.

    What local stress follows from: a member in a face of a wall is strained as the wall is there.
    """
    return _rotated(
        model, _scale(model, rho) * _law_stiffness(model, effective_density(model, rho))
    )


def cell_stiffness_derivative(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """d(cell stiffness)/d(rho), shaped as `cell_stiffness`, MPa."""
    return _rotated(model, _scale(model, rho) * _relative_slope(model, rho))


def lattice_stiffness(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Corrected stiffness of the lattice phase in global axes, ``(6, 6, [4 or 10,] M)``, MPa."""
    if model.walls is None:
        return cell_stiffness(model, rho)
    whole = _scale(model, rho) * _law_stiffness(model, effective_density(model, rho))
    return _rotated(model, model.walls.stiffness(whole, rho))


def lattice_stiffness_derivative(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """d(lattice stiffness)/d(rho), shaped as `lattice_stiffness`, MPa."""
    scale = _scale(model, rho)
    slope = scale * _relative_slope(model, rho)
    if model.walls is None:
        return _rotated(model, slope)
    whole = scale * _law_stiffness(model, effective_density(model, rho))
    return _rotated(model, model.walls.stiffness_slope(whole, slope, rho))


def as_stiffness(C: FloatArray) -> Stiffness:
    """Stiffness record of an array of this module, to be assembled or evaluated."""
    if C.ndim == 3:
        return AnisotropicStiffness(C=C)
    return GaussStiffness(C=C) if C.shape[2] == 4 else MomentStiffness(C=C)


def effective_stiffness(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Stiffness of both phases, ``(6, 6, [4 or 10,] M)``, MPa."""
    lattice = in_lattice(model, lattice_stiffness(model, rho))
    solid = solid_stiffness(model).reshape(6, 6, *(1,) * (lattice.ndim - 2))
    if model.solid_moments is not None:
        return np.asarray(lattice + model.solid_moments * solid)
    if model.walls is not None:
        solid = solid * UNIFORM[:, None]
    return np.asarray(lattice + model.solid_fraction * solid)


def in_lattice(model: HomogenisedModel, C: FloatArray) -> FloatArray:
    """Contribution of lattice of stiffness ``C`` where it lies, ``(6, 6, [4 or 10,] M)``, MPa.

    A stiffness that varies inside the tetrahedra is thinned out in proportion to the room for
    lattice, moment by moment.
    """
    return _in_room(C, _room(model))


def _room(model: HomogenisedModel) -> FloatArray:
    """Share of the tetrahedra for lattice, ``([10,] M)``, as `StiffnessSlopes.rooms`."""
    if model.solid_moments is None:
        return 1 - model.solid_fraction
    return 1 - model.solid_moments / UNIFORM[:, None]


def _in_room(C: FloatArray, room: FloatArray) -> FloatArray:
    """Contribution of lattice of stiffness ``C`` in its room, ``(6, 6, [4 or 10,] M)``, MPa."""
    if room.ndim == 1:
        return np.asarray(room * C)
    if C.ndim == 3:
        return np.asarray(C[:, :, None] * (room * UNIFORM[:, None]))
    return np.asarray((gauss_moments(C) if C.shape[2] == 4 else C) * room)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StiffnessSlopes:
    """Derivatives of the stiffness of every tetrahedron by the variables of its design."""

    by_density: FloatArray  #: ``(6, 6, [4 or 10,] M)``, MPa. Of the lattice, where it fills all.
    #: ``(6, 6, [4 or 10,] M)``, MPa. Solid less what lies there; None: no members.
    replaced: FloatArray | None
    #: ``([10,] M)`` each. Share of the tetrahedra for lattice, and that which each share of members
    #: takes; moment by moment, over those of an even room, where it varies inside.
    rooms: tuple[FloatArray, ...]

    def __iter__(self) -> Iterator[Stiffness]:
        """The derivative by the densities, then those by each share of members."""
        for C, rooms in self._parts():
            for room in rooms:
                yield as_stiffness(_in_room(C, room))

    def energies(
        self, space: TetSpace, fields: Sequence[tuple[FloatArray, FloatArray]]
    ) -> FloatArray:
        """Bilinear energies ``u^T dK/dp v`` of pairs of displacements, ``(k, P)``, N mm."""
        found: list[list[FloatArray]] = [[] for _ in fields]
        for C, rooms in self._parts():
            pairs = pair_energies(space, as_stiffness(C), fields)
            for mine, terms in zip(found, pairs, strict=True):
                mine += [(terms.T * room).sum(axis=0) for room in rooms]
        return np.array([np.concatenate(mine) for mine in found])

    def _parts(self) -> Iterator[tuple[FloatArray, tuple[FloatArray, ...]]]:
        """Every stiffness with the rooms in which it lies."""
        yield self.by_density, self.rooms[:1]
        if self.replaced is not None:
            yield self.replaced, self.rooms[1:]


def stiffness_slopes(
    model: HomogenisedModel, rho: FloatArray, lattice_alone: HomogenisedModel | None
) -> StiffnessSlopes:
    """Derivatives of the stiffness of every tetrahedron by the variables of its design.

    By its density, and by the shares of members at its Gauss points where the model without these,
    ``lattice_alone``, is given: what that holds beside solid is what they replace.
    """
    by_density, room = lattice_stiffness_derivative(model, rho), _room(model)
    if lattice_alone is None:
        return StiffnessSlopes(by_density=by_density, replaced=None, rooms=(room,))
    lattice = lattice_stiffness(lattice_alone, rho)
    solid = solid_stiffness(model).reshape(6, 6, *(1,) * (lattice.ndim - 2))
    if lattice.shape[2] == len(UNIFORM):
        solid = solid * UNIFORM[:, None]
    taken = [by / UNIFORM[:, None] for by in moments_by_share(lattice_alone)]
    return StiffnessSlopes(by_density=by_density, replaced=solid - lattice, rooms=(room, *taken))


def _correction_factor(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Correction of the lattice's stiffness by explicit analyses, ``(M,)``."""
    grown = (rho / model.reference_density) ** model.stiffness_exponent
    return np.asarray(model.stiffness_factor * grown)


def _scale(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Factor on the law's relative stiffness, ``(M,)``, MPa."""
    return model.material.youngs_modulus * _correction_factor(model, rho)


def _relative_slope(model: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Derivative of scale times law's stiffness by density, over the scale, ``(6, 6, M)``."""
    effective = effective_density(model, rho)
    slope = _law_slope(model, effective) * effective_slope(model, rho)
    if model.stiffness_exponent:
        slope = slope + model.stiffness_exponent / rho * _law_stiffness(model, effective)
    return slope


def _law_stiffness(model: HomogenisedModel, effective: FloatArray) -> FloatArray:
    """Stiffness of the law, in proportion to the solid beyond the ends of its window.

    Only effective densities beside passive regions leave the window; nominal ones never do.
    """
    if model.effective is None:
        return model.law.stiffness(effective)
    inside = np.clip(effective, *model.law.window)
    return model.law.stiffness(inside) * (effective / inside)


def _law_slope(model: HomogenisedModel, effective: FloatArray) -> FloatArray:
    """Derivative of `_law_stiffness` by the effective density."""
    if model.effective is None:
        return model.law.stiffness_derivative(effective)
    inside = np.clip(effective, *model.law.window)
    return np.where(
        inside == effective,
        model.law.stiffness_derivative(inside),
        model.law.stiffness(inside) / inside,
    )


def _rotated(model: HomogenisedModel, relative: FloatArray) -> FloatArray:
    """Turn ``(6, 6, [10,] M)`` from cell to global axes; identity costs nothing.

    Where axes turn from point to point, ``(6, 6, M)`` becomes ``(6, 6, 4, M)``.
    """
    bond = model.rotation
    if bond.ndim == 4:
        half = np.einsum("aiqm,ijm->ajqm", bond, relative)
        return np.einsum("ajqm,bjqm->abqm", half, bond)
    if np.array_equal(bond, np.eye(6)):
        return relative
    return np.einsum("ai,ij...,bj->ab...", bond, relative, bond, optimize=True)
