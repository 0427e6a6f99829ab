"""Buckling of frames of slender beams, periodic with a Bloch wave or finite: an independent oracle.

Three-dimensional Euler-Bernoulli beams with the consistent geometric stiffness of their axial force
(Przemieniecki, Theory of Matrix Structural Analysis, 1968, chapter 15). Joints are rigid; ends of a
strut may be stiff, which stands for the thick node. Left out: shear of the struts, the prestress of
their bending, warping, nodes that yield to the struts' ends as solids do. Struts beyond a radius of
a tenth of their length are no slender beams any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from gradedesign.arrays import FloatArray, IntArray

#: Stiffness of the stiff ends over the strut's own: bends 1e-4 as much.
_STIFF = 1e4
#: Elements along the flexible part of a strut: the load of a swaying column is right to 1e-4.
PIECES = 3
_VOIGT = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """Beams between nodes, E = 1.

    Attributes
    ----------
    nodes : (n, 3) array
    ends : (m, 2) int array
    shift : (m, 3) array
        Added to the place of the second end: whole periods; zero in a finite frame.
    area, torsion : (m,) arrays
        Torsion with G = 1 / 2.6.
    inertia : (m, 3, 3) array
        Second moment of area about the centroid, as a tensor in the plane of the section.
    """

    nodes: FloatArray
    ends: IntArray
    shift: FloatArray
    area: FloatArray
    torsion: FloatArray
    inertia: FloatArray


def frame_of(
    nodes: FloatArray,
    ends: IntArray,
    shift: FloatArray,
    radius: float,
    *,
    stiff_end: float = 0.0,
    sections: Sequence[tuple[float, FloatArray]] | None = None,
    pieces: int = PIECES,
) -> Frame:
    """Frame of struts, each of several elements, with stiff ends of a given length.

    ``sections`` gives area and second moment ``(3, 3)`` of every strut, else they are round.
    """
    place, a, b, moved, area, twist, inertia = list(nodes), [], [], [], [], [], []
    for number, (i, j) in enumerate(ends):
        start, stop = nodes[i], nodes[j] + shift[number]
        axis = stop - start
        length = float(np.linalg.norm(axis))
        axis = axis / length
        if sections is None:
            section = np.pi * radius**2
            moment = np.pi * radius**4 / 4 * (np.eye(3) - np.outer(axis, axis))
        else:
            section, moment = sections[number]
        cuts = stiff_end + (length - 2 * stiff_end) * np.linspace(0, 1, pieces + 1)
        if stiff_end:
            cuts = np.concatenate([[0.0], cuts, [length]])
        before = int(i)
        for k in range(len(cuts) - 1):
            last = k == len(cuts) - 2
            after = int(j) if last else len(place)
            if not last:
                place.append(start + cuts[k + 1] * axis)
            stiff = stiff_end > 0 and k in (0, len(cuts) - 2)
            scale = _STIFF if stiff else 1.0
            a.append(before)
            b.append(after)
            moved.append(shift[number] if last else np.zeros(3))
            area.append(scale * section)
            inertia.append(scale * moment)
            twist.append(scale * np.trace(moment))
            before = after
    return Frame(
        nodes=np.array(place),
        ends=np.array([a, b]).T,
        shift=np.array(moved),
        area=np.array(area),
        torsion=np.array(twist),
        inertia=np.array(inertia),
    )


def beam_matrices(frame: Frame) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Stiffness and geometric stiffness per unit tension ``(m, 12, 12)``, and axial rows (m, 12).

    Degrees of freedom: displacement and rotation of the first end, then of the second. A row times
    them is the axial force.
    """
    axis = frame.nodes[frame.ends[:, 1]] + frame.shift - frame.nodes[frame.ends[:, 0]]
    length = np.linalg.norm(axis, axis=1)
    stiffness, geometric = np.zeros((2, len(length), 12, 12))
    rows = np.zeros((len(length), 12))
    for e, L in enumerate(length):
        x = axis[e] / L
        # Principal axes of the section: the strut's own has no moment.
        _, v = np.linalg.eigh(frame.inertia[e] - 1e3 * np.trace(frame.inertia[e]) * np.outer(x, x))
        y, z = v[:, 1], v[:, 2]
        turn = np.array([x, y, z]) if np.linalg.det([x, y, z]) > 0 else np.array([x, y, -z])
        y, z = turn[1], turn[2]
        # `inertia` is the integral of (r r^T): bending along y has y.inertia.y.
        k, g = np.zeros((12, 12)), np.zeros((12, 12))
        for at, value in (((0, 6), frame.area[e] / L), ((3, 9), frame.torsion[e] / 2.6 / L)):
            k[np.ix_(at, at)] += value * np.array([[1, -1], [-1, 1]])
        for at, sign, second in (
            ((1, 5, 7, 11), 1.0, y @ frame.inertia[e] @ y),
            ((2, 4, 8, 10), -1.0, z @ frame.inertia[e] @ z),
        ):
            d = np.diag([1.0, sign, 1.0, sign])
            bend = np.array(
                [
                    [12, 6 * L, -12, 6 * L],
                    [6 * L, 4 * L * L, -6 * L, 2 * L * L],
                    [-12, -6 * L, 12, -6 * L],
                    [6 * L, 2 * L * L, -6 * L, 4 * L * L],
                ]
            )
            pull = np.array(
                [
                    [36, 3 * L, -36, 3 * L],
                    [3 * L, 4 * L * L, -3 * L, -L * L],
                    [-36, -3 * L, 36, -3 * L],
                    [3 * L, -L * L, -3 * L, 4 * L * L],
                ]
            )
            k[np.ix_(at, at)] += second / L**3 * d @ bend @ d
            g[np.ix_(at, at)] += d @ pull @ d / (30 * L)
        t = np.kron(np.eye(4), turn)
        stiffness[e], geometric[e] = t.T @ k @ t, t.T @ g @ t
        rows[e] = frame.area[e] / L * np.concatenate([-x, np.zeros(3), x, np.zeros(3)])
    return stiffness, geometric, rows


def assembled(frame: Frame, blocks: FloatArray, wave: FloatArray) -> scipy.sparse.csc_array:
    """Sum element matrices with the phase of a wave vector over the shifts; real where it is 0."""
    at = freedoms(frame)
    if wave.any():
        phase = np.exp(1j * (frame.shift @ wave))
        p = np.concatenate([np.ones((6, len(phase))), np.tile(phase, (6, 1))]).T
        blocks = np.conj(p)[:, :, None] * blocks * p[:, None, :]
    row, column = np.broadcast_arrays(at[:, :, None], at[:, None, :])
    count = 6 * len(frame.nodes)
    places = (row.ravel(), column.ravel())
    return scipy.sparse.coo_array((blocks.ravel(), places), shape=(count, count)).tocsc()


def freedoms(frame: Frame) -> IntArray:
    """Degrees of freedom of every beam, ``(m, 12)``."""
    return np.concatenate([6 * frame.ends[:, [k]] + np.arange(6) for k in (0, 1)], axis=1)


def periodic_forces(frame: Frame, volume: float) -> tuple[FloatArray, FloatArray]:
    """Homogenised stiffness ``(6, 6)`` and axial forces ``(m, 6)`` under unit Voigt strains."""
    k, _, rows = beam_matrices(frame)
    total = assembled(frame, k, np.zeros(3)).toarray()
    jumps = np.zeros((len(frame.ends), 12, 6))
    for a, (p, q) in enumerate(_VOIGT):
        strain = np.zeros((3, 3))
        strain[p, q] = strain[q, p] = 1.0 if p == q else 0.5
        jumps[:, 6:9, a] = frame.shift @ strain
    at, load = freedoms(frame), np.zeros((len(total), 6))
    np.add.at(load, at, np.einsum("eab,ebc->eac", k, jumps))
    # Translations are free, and a wall's turn about its middle line; the least solution is one.
    u = -np.linalg.lstsq(total, load, rcond=1e-12)[0]
    local = u[at] + jumps
    energy = np.einsum("eac,eab,ebd->cd", local, k, local) / volume
    return energy, np.einsum("ea,eac->ec", rows, local)


def bloch_factor(
    frame: Frame, stress: FloatArray, volume: float, waves: FloatArray
) -> tuple[float, FloatArray]:
    """Least factor on a macroscopic Voigt stress that buckles the frame over waves ``(w, 3)``.

    ``inf`` where none does; and its wave vector.
    """
    stiffness, forces = periodic_forces(frame, volume)
    axial = forces @ np.linalg.lstsq(stiffness, stress, rcond=1e-9)[0]
    k, g, _ = beam_matrices(frame)
    best, at = np.inf, np.zeros(3)
    for wave in waves:
        elastic = assembled(frame, k, wave).toarray()
        pull = assembled(frame, axial[:, None, None] * g, wave).toarray()
        last = [len(pull) - 1] * 2
        lowest = scipy.linalg.eigh(-pull, elastic, eigvals_only=True, subset_by_index=last)[0]
        if lowest > 1 / best:
            best, at = 1 / float(lowest), wave
    return best, at


def column_load(frame: Frame, bottom: IntArray, top: IntArray, *, top_sways: bool) -> float:
    """Least compressive force along z that buckles a finite frame between stiff plates.

    Parameters
    ----------
    bottom, top : (k,) int array
        Nodes in the plates: the lower plate is held, the upper one moves along z, and sideways too
        where it sways; it does not tilt.
    """
    k, g, rows = beam_matrices(frame)
    elastic, count = assembled(frame, k, np.zeros(3)), 6 * len(frame.nodes)
    plates = np.concatenate([6 * nodes + d for nodes in (bottom, top) for d in range(6)])
    inner = np.setdiff1d(np.arange(count), plates)
    moves = (2, 0, 1) if top_sways else (2,)
    plate = scipy.sparse.coo_array(
        (
            np.ones(len(top) * len(moves)),
            (
                np.concatenate([6 * top + d for d in moves]),
                np.repeat(len(inner) + np.arange(len(moves)), len(top)),
            ),
        ),
        shape=(count, len(inner) + len(moves)),
    )
    inside = scipy.sparse.coo_array(
        (np.ones(len(inner)), (inner, np.arange(len(inner)))), shape=plate.shape
    )
    basis = (plate + inside).tocsc()
    reduced = (basis.T @ elastic @ basis).tocsc()
    load = np.zeros(reduced.shape[0])
    load[len(inner)] = -1.0
    axial = np.einsum(
        "ea,ea->e", rows, (basis @ scipy.sparse.linalg.spsolve(reduced, load))[freedoms(frame)]
    )
    pull = (basis.T @ assembled(frame, axial[:, None, None] * g, np.zeros(3)) @ basis).tocsc()
    free = np.setdiff1d(np.arange(reduced.shape[0]), [] if top_sways else [len(inner)])
    reduced, pull = reduced[free][:, free], pull[free][:, free]
    solve = scipy.sparse.linalg.splu(reduced.tocsc()).solve
    inverse = scipy.sparse.linalg.LinearOperator(reduced.shape, matvec=solve)
    start = np.random.default_rng(73).standard_normal(len(free))
    largest = scipy.sparse.linalg.eigsh(
        -pull, k=1, M=reduced, Minv=inverse, which="LA", v0=start, return_eigenvectors=False
    )
    return 1 / float(largest[0])


def lattice_frame(
    nodes: FloatArray,
    ends: IntArray,
    shift: FloatArray,
    radius: float,
    cells: tuple[int, int, int],
    free: tuple[bool, bool, bool],
    *,
    stiff_end: float = 0.0,
    pieces: int = PIECES,
) -> Frame:
    """Cells of a periodic graph (cell edge 1), with free faces across some axes.

    Struts that lie in a free face are halves or quarters, cut there; those that would leave are
    gone. Across the other axes the cells repeat after their number.
    """
    span = np.array(cells)
    index: dict[tuple[int, ...], int] = {}
    place: list[FloatArray] = []

    def number(point: FloatArray) -> tuple[int, FloatArray]:
        moved = np.where(free, 0, np.floor(point / span + 1e-9)) * span
        key = tuple(np.round(1e6 * (point - moved)).astype(int))
        if key not in index:
            index[key] = len(place)
            place.append(point - moved)
        return index[key], moved

    chosen: dict[tuple[int, ...], tuple] = {}
    # One more layer than the cells: the far faces are there too.
    for cell in np.ndindex(*(span + 1)):
        for (i, j), step in zip(ends, shift, strict=True):
            a, b = nodes[i] + cell, nodes[j] + step + cell
            outside = [
                np.any((p < -1e-9) | (p > span + 1e-9), where=np.array(free)) for p in (a, b)
            ]
            if any(outside):
                continue
            (p, from_), (q, to) = number(a), number(b)
            there = to - from_
            back = (q, p, *np.round(-there).astype(int))
            key = (p, q, *np.round(there).astype(int))
            if key in chosen or back in chosen:
                continue
            cut = [
                sign * np.eye(3)[k]
                for k in range(3)
                if free[k]
                for sign, face in ((-1.0, 0.0), (1.0, float(span[k])))
                if abs(a[k] - face) < 1e-9 and abs(b[k] - face) < 1e-9
            ]
            chosen[key] = (p, q, there, cut_section(radius, b - a, cut))
    return frame_of(
        np.array(place),
        np.array([c[:2] for c in chosen.values()]),
        np.array([c[2] for c in chosen.values()]),
        radius,
        stiff_end=stiff_end,
        sections=[c[3] for c in chosen.values()],
        pieces=pieces,
    )


def cut_section(
    radius: float, axis: FloatArray, normals: Sequence[FloatArray]
) -> tuple[float, FloatArray]:
    """Area and second moment of a round section cut by planes through its centre, by samples."""
    axis = axis / np.linalg.norm(axis)
    side = np.linalg.svd(axis[None])[2][1:]
    grid = (np.arange(200) + 0.5) / 100 - 1
    points = radius * np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    points = points[np.linalg.norm(points, axis=1) <= radius] @ side
    for normal in normals:
        points = points[points @ normal <= 0]
    share = (radius / 100) ** 2
    points = points - points.mean(axis=0)
    return len(points) * share, share * points.T @ points
