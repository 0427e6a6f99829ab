"""Places of labels in a picture: none covers another, none leaves it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.program.pictures.scene import (
    SIZE,
    Arrow,
    Frame,
    Label,
    LegendEntry,
    Lines,
    legend_box,
)

#: Pixels of a letter, of a label's height, and of the margin around a text. Chosen, not measured.
_LETTER, HEIGHT, _MARGIN = 11.5, 34.0, 14.0
#: Half the pixels that an arrow is thick. Chosen, not measured.
_THICK = 9.0
#: Rows and columns that a label may move by to find room. Chosen, not measured.
_ROWS, _COLUMNS = 12, (0.0, 0.5, -0.5, 1.0, -1.0)


def separated(
    labels: Sequence[Label],
    frame: Frame,
    arrows: Sequence[Arrow] = (),
    legend: Sequence[LegendEntry] = (),
) -> tuple[tuple[Label, ...], tuple[Lines, ...]]:
    """Labels moved in the plane of the picture until none overlaps, and strokes to their points.

    ``labels``: their points are the lower left corners of their boxes. Earlier ones keep their
    places. ``arrows``: left free as well, where there is room. ``legend``: likewise. Returns
    ``strokes``: from the point of each label that was moved to where it stands.
    """
    scale = frame.height / SIZE[1]
    placed = [box for arrow in arrows for box in _arrow_boxes(arrow, frame)]
    placed.append(legend_box(legend).astype(np.float64))
    moved: list[Label] = []
    strokes: list[Lines] = []
    for label in labels:
        box = label_box(label, frame)
        shift = _free_shift(box, placed)
        placed.append(box + np.array([[shift[0]], [shift[1]]]))
        step = scale * (shift[0] * frame.right + shift[1] * frame.up)
        moved.append(Label(point=label.point + step, text=label.text, colour=label.colour))
        if np.hypot(*shift) > HEIGHT:
            segment = np.stack([label.point, label.point + step])[None]
            strokes.append(Lines(segments=segment, colour=label.colour, width=1.5))
    return tuple(moved), tuple(strokes)


def label_box(label: Label, frame: Frame) -> FloatArray:
    """Left and right, bottom and top of a label, ``(2, 2)`` pixels."""
    x, y = _pixels(label.point, frame)
    return np.array([[x, x + _LETTER * len(label.text) + _MARGIN], [y, y + HEIGHT]])


def _pixels(point: FloatArray, frame: Frame) -> tuple[float, float]:
    """Place of a point ``(3,)`` mm in the picture, from its lower left corner."""
    scale = SIZE[1] / frame.height
    offset = point - frame.middle
    x = scale * float(offset @ frame.right) + 0.5 * SIZE[0]
    y = scale * float(offset @ frame.up) + 0.5 * SIZE[1]
    return x, y


def _arrow_boxes(arrow: Arrow, frame: Frame) -> list[FloatArray]:
    """Squares along an arrow, the one at its end left out: a label may touch the tip."""
    boxes = []
    for share in np.linspace(0.0, 0.95, 8):
        x, y = _pixels(arrow.tail + share * (arrow.tip - arrow.tail), frame)
        boxes.append(np.array([[x - _THICK, x + _THICK], [y - _THICK, y + _THICK]]))
    return boxes


def _free_shift(box: FloatArray, placed: Sequence[FloatArray]) -> FloatArray:
    """Least move that stays in the picture and clears the boxes; none if there is no room."""
    inward = np.array([min(0.0, SIZE[0] - 5.0 - box[0, 1]), 0.0])
    inward[0] = max(inward[0], 5.0 - box[0, 0])
    width = box[0, 1] - box[0, 0]
    candidates = [
        inward + np.array([column * width, sign * row * HEIGHT])
        for row in range(_ROWS)
        for column in _COLUMNS
        for sign in (1, -1)
    ]
    for shift in sorted(candidates, key=lambda s: float(np.hypot(*s))):
        there = box + shift[:, None]
        inside = there[0, 0] >= 0 and there[0, 1] <= SIZE[0] and there[1, 0] >= 40
        if inside and there[1, 1] <= SIZE[1] - 50 and not any(_overlap(there, p) for p in placed):
            return shift
    return inward


def _overlap(first: FloatArray, second: FloatArray) -> bool:
    return bool(np.all((first[:, 0] < second[:, 1]) & (second[:, 0] < first[:, 1])))
