"""Solid members among the lattice: the share of every tetrahedron that sizing makes solid.

A filtered variable between 0 and 1 becomes a share by a smooth step, steeper and steeper (Wang,
Lazarov, Sigmund, Struct. Multidisc. Optim. 43, 2011, equation 9). Solid and lattice of a
tetrahedron are strained alike, so that stiffness is linear in the share; a share between costs more
than it weighs, which makes shares all or nothing. The price is the inverse of the rational
interpolation of stiffness by Stolpe and Svanberg (Struct. Multidisc. Optim. 22, 2001, equation 6),
put on the mass: one and the same at 0 and 1, and finite in its slopes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.mechanics.fe.stiffness import UNIFORM
from gradedesign.mechanics.sizing.filter import DensityFilter, filtered
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel

#: Added to the variables of members, whose logarithms sizing changes: a share of solid that is as
#: stiff as lattice of low density, so that a step changes the stiffness of both by like shares.
LEAST_MEMBER = 0.05
#: Sharpness below which the step is a straight line: it bends by less than a thousandth there.
_STRAIGHT = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Members:
    """Solid members as variables of sizing.

    Attributes
    ----------
    filter : DensityFilter
        From the variables of tetrahedra, 0 to 1, to a value of each, which the step makes its
        share.
    radius : float, mm
        Of that filter, which follows from the least member.
    sharpness : float
        Of the step; 0: the share is the filtered variable itself.
    price : float
        How much more a share between 0 and 1 costs than it weighs: ``1 + price`` times near 0.
    """

    filter: DensityFilter
    radius: float
    sharpness: float = 0.0
    price: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class MemberField:
    """Where the bodies of solid members lie.

    Attributes
    ----------
    variables : (M,) array
        Of every tetrahedron, not filtered: their surface is where the filtered ones are a half.
    radius : float, mm
        Of the filter.
    offset : float, mm
        By which the surface is moved outward then.
    """

    variables: FloatArray
    radius: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "variables", locked(self.variables, (None,), name="variables"))


def member_shares(members: Members, b: FloatArray) -> FloatArray:
    """Share of every tetrahedron ``(M,)`` of variables ``(n,)``."""
    return stepped(members, filtered(members.filter, b))


def stepped(members: Members, field: FloatArray) -> FloatArray:
    """Shares of filtered variables, both ``(M,)``."""
    x, beta = np.clip(field, 0.0, 1.0), members.sharpness
    if beta <= _STRAIGHT:
        return x
    return np.asarray(0.5 + 0.5 * np.tanh(beta * (x - 0.5)) / np.tanh(0.5 * beta))


def share_slope(members: Members, b: FloatArray) -> FloatArray:
    """Derivative of every share by its filtered variable, ``(M,)``."""
    x = np.clip(filtered(members.filter, b), 0.0, 1.0)
    beta = members.sharpness
    if beta <= _STRAIGHT:
        return np.ones_like(x)
    return np.asarray(0.5 * beta / np.cosh(beta * (x - 0.5)) ** 2 / np.tanh(0.5 * beta))


def member_price(members: Members, share: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share that a share costs, and its derivative, both ``(M,)``."""
    base = 1.0 + members.price * share
    return (1.0 + members.price) * share / base, (1.0 + members.price) / base**2


def with_members(model: HomogenisedModel, share: FloatArray | None) -> HomogenisedModel:
    """The model with a share of the lattice's room in every tetrahedron, ``(M,)``, made solid."""
    if share is None:
        return model
    moments = model.solid_moments
    if moments is not None:
        moments = moments + share * (UNIFORM[:, None] - moments)
    members = share * (1.0 - model.solid_fraction)
    return replace(
        model,
        solid_fraction=model.solid_fraction + members,
        solid_moments=moments,
        member_fraction=members,
    )
