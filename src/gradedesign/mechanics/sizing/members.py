"""Solid members among the lattice: the share of the part that sizing makes solid.

A filtered variable between 0 and 1 becomes a share by a smooth step, steeper and steeper (Wang,
Lazarov, Sigmund, Struct. Multidisc. Optim. 43, 2011, equation 9), at the four Gauss points of every
tetrahedron: the surface of a member passes through tetrahedra, which are about as large as it is
thick. Members weigh what a step at a half makes; where a step at a higher threshold carries (their
eroded design), none is so thin that single Gauss points alone hold it. Solid and lattice at a point
are strained alike, so that stiffness is linear in the shares; a share between costs more than it
weighs, which makes shares all or nothing. The price is the inverse of the rational interpolation of
stiffness by Stolpe and Svanberg (Struct. Multidisc. Optim. 22, 2001, equation 6), put on the mass:
one and the same at 0 and 1, and finite in its slopes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import Field, FloatArray, locked
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.fe.element_points import gauss_interpolation
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import GAUSS_MOMENTS, UNIFORM
from gradedesign.mechanics.sizing.filter import DensityFilter, cone_filter, filtered
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel, filter_weights

#: Added to the variables of members, whose logarithms sizing changes: a share of solid that is as
#: stiff as lattice of low density, so that a step changes the stiffness of both by like shares.
LEAST_MEMBER = 0.05
#: Filtered variable at the surface of a member.
HALF = 0.5
#: Sharpness below which the step is a straight line: it bends by less than a thousandth there.
_STRAIGHT = 0.1
#: Gauss points of a tetrahedron, each of a quarter of its volume.
POINTS = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Members:
    """Solid members as variables of sizing."""

    #: From the variables of tetrahedra, 0 to 1, to a value at each of their Gauss points, which the
    #: step makes a share: `member_filter`.
    filter: DensityFilter
    radius: float  #: mm. Of that filter, which follows from the least member.
    sharpness: float = 0.0  #: Of the step; 0: the share is the filtered variable itself.
    #: Filtered variable from which on members carry; they weigh from a half on.
    threshold: float = HALF
    #: How much more a share between 0 and 1 costs than it weighs: ``1 + price`` times near 0.
    price: float = 0.0
    #: ``(4 M,)``. 1 at the Gauss points where members may be, 0 elsewhere; None: everywhere.
    allowed: FloatArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class MemberField:
    """Where the bodies of solid members lie."""

    #: ``(M,)``. Of every tetrahedron, not filtered: their surface is where the filtered ones are a
    #: half.
    variables: FloatArray
    radius: float  #: mm. Of the filter.
    offset: float = 0.0  #: mm. By which the surface is moved outward then.
    threshold: float = HALF  #: That of `Members`, with which they were sized.
    tied: bool = False  #: Whether some of them tie in what would stand alone.

    def __post_init__(self) -> None:
        object.__setattr__(self, "variables", locked(self.variables, (None,), name="variables"))


def member_filter(model: HomogenisedModel, radius: float) -> DensityFilter:
    """The cone of `cone_filter` from tetrahedra to their Gauss points, ``(4 M, M)``.

    The first points of all tetrahedra come first. Taken at the nodes and interpolated between them,
    of which there are fewer.
    """
    space = model.space
    at_nodes = cone_filter(centroids(space.mesh), filter_weights(model), radius, space.nodes)
    return DensityFilter(factors=(gauss_interpolation(space), *at_nodes.factors))


def allowed_points(space: TetSpace, weight: Field) -> FloatArray:
    """1 at the Gauss points of all tetrahedra where a weight is at least a half, 0 elsewhere."""
    points = (gauss_interpolation(space) @ space.nodes.T).T
    return np.asarray(weight(points) >= HALF, dtype=np.float64)


def member_shares(members: Members, b: FloatArray) -> FloatArray:
    """Shares at the Gauss points ``(4 M,)`` that carry, of variables ``(n,)``."""
    return stepped(members, filtered(members.filter, b), members.threshold)


def mean_share(share: FloatArray) -> FloatArray:
    """Share of every tetrahedron ``(M,)`` of those at its Gauss points ``(4 M,)``."""
    return np.asarray(share.reshape(POINTS, -1).mean(axis=0))


def at_points(by_share: FloatArray) -> FloatArray:
    """Derivatives by shares at Gauss points, ``(4 M,)``, of those by their means, ``(M,)``."""
    return np.tile(by_share / POINTS, POINTS)


def stepped(members: Members, field: FloatArray, threshold: float = HALF) -> FloatArray:
    """Shares of filtered variables, both ``(4 M,)``: 0 at 0, and 1 at 1 where members may be."""
    x, beta = np.clip(field, 0.0, 1.0), members.sharpness
    if beta > _STRAIGHT:
        below, above = np.tanh(beta * threshold), np.tanh(beta * (1.0 - threshold))
        x = (below + np.tanh(beta * (x - threshold))) / (below + above)
    return x if members.allowed is None else x * members.allowed


def step_slope(members: Members, field: FloatArray, threshold: float = HALF) -> FloatArray:
    """Derivative of every share by its filtered variable, both ``(4 M,)``."""
    x, beta = np.clip(field, 0.0, 1.0), members.sharpness
    slope = np.ones_like(x)
    if beta > _STRAIGHT:
        whole = np.tanh(beta * threshold) + np.tanh(beta * (1.0 - threshold))
        slope = beta / np.cosh(beta * (x - threshold)) ** 2 / whole
    return slope if members.allowed is None else slope * members.allowed


def member_price(members: Members, share: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share that a share costs, and its derivative, both ``(4 M,)``."""
    base = 1.0 + members.price * share
    return (1.0 + members.price) * share / base, (1.0 + members.price) / base**2


def with_members(model: HomogenisedModel, share: FloatArray | None) -> HomogenisedModel:
    """The model with shares of the lattice's room at Gauss points, ``(4 M,)``, made solid.

    ``model`` holds moments of its solid, as `with_moments` makes it.
    """
    if share is None:
        return model
    each = share.reshape(POINTS, -1)
    moments = np.array(with_moments(model).solid_moments)
    for by, own in zip(moments_by_share(model), each, strict=True):
        moments += by * own
    members = each.mean(axis=0) * (1.0 - model.solid_fraction)
    return replace(
        model,
        solid_fraction=model.solid_fraction + members,
        solid_moments=moments,
        member_fraction=members,
    )


def with_moments(model: HomogenisedModel) -> HomogenisedModel:
    """The model with moments of its solid, where it holds none: all solid or none."""
    if model.solid_moments is not None:
        return model
    return replace(model, solid_moments=UNIFORM[:, None] * model.solid_fraction)


def moments_by_share(model: HomogenisedModel) -> list[FloatArray]:
    """Moments of the solid, ``(10, M)``, that a share of 1 at each Gauss point adds.

    All four together fill what the solid leaves. How they differ is taken from a tetrahedron
    without solid, in proportion to its room.
    """
    moments = model.solid_moments
    if moments is None:
        raise ValueError("members need a model that holds the moments of its solid")
    room, free = UNIFORM[:, None] - moments, 1.0 - model.solid_fraction
    return [room / POINTS + free * (own - UNIFORM / POINTS)[:, None] for own in GAUSS_MOMENTS.T]
