"""Smooth frames that follow the principal directions of a tensor field."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import map_coordinates, zoom
from scipy.spatial.transform import Rotation

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import CaseError, ResourceError
from gradedesign.geometry.maps._phase_kernels import nearest_rotations

#: Grid steps in the length over which frames are smoothed, and most elements of the grid. Chosen,
#: not measured.
_STEPS_PER_LENGTH, MOST_ELEMENTS = 2.0, 1_000_000
#: Coarser grids first, by their step over that of the last, and passes on each. Chosen, not
#: measured.
LEVELS = ((4, 80), (2, 80), (1, 120))
#: A tensor this large, by percentile, counts fully; smaller ones in proportion. So that peaks at
#: supports do not decide what counts. Chosen, not measured.
_FULL_PERCENTILE = 95.0
#: All frames begin as one: turned a little, rad, to leave unstable balance, then over this many
#: passes to where the mean shear is least, by at most so much in a pass.
_TIE_BREAK, _ONE_FRAME_PASSES, _LARGEST_SPIN = (1e-6, 2e-6, 3e-6), 300, 0.3
#: Pairs of rows with the third about which they turn.
_PLANES = ((0, 1), (1, 2), (2, 0))


def frame_field(
    tensor_of: Field,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    length: float,
    start: ArrayLike | None = None,
) -> Field:
    """Rotations whose rows are as nearly principal directions as smoothness allows.

    Minimises ``integral of w (sum of squared shears) + length^2 |grad R|^2``: the shears are the
    off-diagonal entries of the unit tensor in the frame, ``w`` its size. That says nothing about
    which row takes which direction, nor about signs, as befits cells of cubic symmetry, and leaves
    frames free where principal values are equal or the tensor vanishes.

    Returns callable: points ``(3, ...)`` mm to rotations ``(3, 3, ...)``. Raises CaseError if the
    box, the length or a tensor is impossible. Raises ResourceError if the grid would have more than
    `MOST_ELEMENTS` elements.

    - ``tensor_of``: points ``(3, ...)`` mm to symmetric tensors ``(3, 3, ...)`` of any unit
    - ``lower (3,)``, ``upper (3,)``, mm: box; frames beyond it are those of its border
    - ``length``, mm: over which frames are smoothed
    - ``start (3, 3)``: rows of the frame from which all begin, together; the axes of the box by
      default. The field can be combed flat into it, so it has no singular lines: directions that go
      all round an axis are followed on one side of it only.

    Notes
    -----
    Gradient descent by Jacobi rotations, mean of neighbours and nearest rotation in turn, on three
    grids: the cubic frame fields of Huang et al., "Boundary aligned smooth 3D cross-frame field",
    ACM Trans. Graph. 30 (2011), without their singularities.
    """
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    if not (np.isfinite(length) and length > 0 and (high > low).all()):
        raise CaseError(
            f"frames are smoothed over {length:g} mm in a box of {(high - low).tolist()} mm; "
            f"expected positive lengths"
        )
    count = np.maximum(np.ceil((high - low) * _STEPS_PER_LENGTH / length), 2).astype(np.int64)
    if np.prod(count.astype(np.float64)) > MOST_ELEMENTS:
        raise ResourceError(
            f"frames smoothed over {length:g} mm need {np.prod(count.astype(float)):.3g} grid "
            f"elements, more than {MOST_ELEMENTS:.3g}; smooth over a longer distance"
        )
    first = np.eye(3) if start is None else np.asarray(start, dtype=np.float64)
    frames = np.zeros((1, 1, 1, 3, 3))
    for coarser, passes in LEVELS:
        shape = tuple(int(n) for n in np.maximum(-(-count // coarser), 1))
        tensor = _unit_tensors(tensor_of, _centres(low, high, shape))
        if coarser == LEVELS[0][0]:
            frames[:] = _one_frame(first, tensor)
        frames = _resampled(frames, shape)
        step = float(np.max((high - low) / shape))
        gain = step**2 / (6 * length**2)
        for _ in range(passes):
            frames = _aligned(_averaged(frames), tensor, gain)
    return _interpolated(frames, low, high)


def principal_angle(axes: FloatArray, tensor: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Angle from the largest principal direction to the nearest cell axis, and its weight.

    ``axes (3, 3, n)``: columns are the cell axes. ``tensor (3, 3, n)``. Returns ``angle (n,)``,
    degrees: at most 54.7; ``weight (n,)``: largest principal value by size.
    """
    values, vectors = np.linalg.eigh(np.moveaxis(tensor, -1, 0))
    rank = np.abs(values).argmax(axis=1)
    n = np.arange(rank.size)
    main = vectors[n, :, rank]
    cosine = np.abs(np.einsum("ian,ni->an", axes, main)).max(axis=0)
    return np.degrees(np.arccos(np.minimum(cosine, 1.0))), np.abs(values)[n, rank]


def _centres(low: FloatArray, high: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Centres of elements, ``(3, nx, ny, nz)``, mm."""
    lines = [
        a + (b - a) * (np.arange(n) + 0.5) / n for a, b, n in zip(low, high, shape, strict=True)
    ]
    return np.stack(np.meshgrid(*lines, indexing="ij"))


def _unit_tensors(tensor_of: Field, centres: FloatArray) -> FloatArray:
    """Tensors ``(nx, ny, nz, 3, 3)`` whose squares have the size of their weight, at most 1."""
    tensors = np.asarray(tensor_of(centres), dtype=np.float64)
    if tensors.shape != (3, 3, *centres.shape[1:]) or not np.isfinite(tensors).all():
        raise CaseError(
            f"the field of directions has shape {tensors.shape} (or values that are not finite), "
            f"expected finite values of shape {(3, 3, *centres.shape[1:])}"
        )
    tensor = np.moveaxis(tensors, (0, 1), (-2, -1))
    size = np.sqrt((tensor**2).sum(axis=(-2, -1)))
    full = float(np.percentile(size, _FULL_PERCENTILE))
    if not full > 0:
        raise CaseError("the field of directions is zero nearly everywhere; nothing to follow")
    weight = np.minimum(size / full, 1.0)
    scale = np.sqrt(weight) / np.maximum(size, 1e-300)
    return np.asarray(tensor * scale[..., None, None])


def _resampled(frames: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Frames of the nearest element of a coarser grid."""
    factors = [n / m for n, m in zip(shape, frames.shape, strict=False)]
    return np.asarray(zoom(frames, (*factors, 1, 1), order=0, mode="nearest", grid_mode=True))


def _averaged(frames: FloatArray) -> FloatArray:
    """Rotations nearest to the mean over the six neighbours."""
    total = np.zeros_like(frames)
    for axis in range(3):
        moved = np.moveaxis(frames, axis, 0)
        sums = np.moveaxis(total, axis, 0)
        sums[1:] += moved[:-1]
        sums[:-1] += moved[1:]
        # A mirror at the border: the field ends without slope.
        sums[0] += moved[0]
        sums[-1] += moved[-1]
    shape = frames.shape
    return nearest_rotations(total.reshape(-1, 3, 3), frames.reshape(-1, 3, 3)).reshape(shape)


def _one_frame(start: FloatArray, tensor: FloatArray) -> FloatArray:
    """The frame nearest to a start that leaves the least shear over all tensors, ``(3, 3)``."""
    # A frame at 45 degrees to a principal direction is in balance, but not stably.
    frame = Rotation.from_rotvec(_TIE_BREAK).as_matrix() @ start
    for _ in range(_ONE_FRAME_PASSES):
        spin = _spin(frame, tensor).mean(axis=(0, 1, 2))
        frame = _turned(frame, spin / max(float(np.abs(spin).max()) / _LARGEST_SPIN, 1.0))
    return frame


def _aligned(frames: FloatArray, tensor: FloatArray, gain: float) -> FloatArray:
    """Turn frames against the gradient of the squared shears."""
    return _turned(frames, gain / (1 + gain) * _spin(frames, tensor))


def _spin(frames: FloatArray, tensor: FloatArray) -> FloatArray:
    """Skew matrices that turn rows towards principal directions, a Newton step for small angles."""
    inside = frames @ tensor @ np.swapaxes(frames, -1, -2)
    spin = np.zeros_like(inside)
    for i, j in _PLANES:
        # Rows i and j turn by theta: a_ij changes by theta (a_jj - a_ii).
        theta = inside[..., i, j] * (inside[..., i, i] - inside[..., j, j])
        spin[..., i, j], spin[..., j, i] = theta, -theta
    return spin


def _turned(frames: FloatArray, spin: FloatArray) -> FloatArray:
    """Frames after a spin; Cayley's transform of a small one is a rotation."""
    eye = np.eye(3)
    return np.asarray(np.linalg.solve(eye - 0.5 * spin, (eye + 0.5 * spin) @ frames))


def _interpolated(frames: FloatArray, low: FloatArray, high: FloatArray) -> Field:
    """Rotations between the elements of a grid."""
    shape = np.array(frames.shape[:3])
    parts = np.moveaxis(frames, (-2, -1), (0, 1)).reshape(9, *frames.shape[:3])

    def frame_of(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        flat = x.reshape(3, -1)
        place = (flat - low[:, None]) / (high - low)[:, None] * shape[:, None] - 0.5
        mean = np.stack([map_coordinates(p, place, order=1, mode="nearest") for p in parts])
        left, _, right = np.linalg.svd(mean.T.reshape(-1, 3, 3))
        # Frames of neighbours differ by less than a right angle, so no mean turns inside out.
        return np.moveaxis(left @ right, 0, -1).reshape(3, 3, *x.shape[1:])

    return frame_of
