"""Stress above the yield strength anywhere that no support disturbs: always told."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Yielding:
    """Volume in which the elastic stress of a load case exceeds the yield strength."""

    load_case: str
    share: float  #: Of the volume that no singularity of a support reaches.
    largest: float  #: MPa. Von Mises stress there.
    place: tuple[float, float, float]  #: mm. Where it is found.
    strength: float  #: MPa.


def yielding(
    points: FloatArray,
    volumes: FloatArray,
    von_mises: Mapping[str, FloatArray],
    undisturbed: BoolArray,
    strength: float,
) -> Yielding | None:
    """The load case with the largest stress above the yield strength; None where none has any.

    - ``points (3, M)``, mm
    - ``volumes (M,)``, mm^3
    - ``von_mises``: by load case, each ``(M, q)``, MPa; each value stands for a q-th of the point's
      volume
    - ``undisturbed (M,)``: points that no singularity of a support reaches
    - ``strength``, MPa
    """
    worst: Yielding | None = None
    weight = volumes[undisturbed]
    for load_case, stress in von_mises.items():
        values = stress[undisturbed]
        if not values.size or (worst is not None and values.max() <= worst.largest):
            continue
        if not values.max() > strength:
            continue
        x, y, z = points[:, undisturbed][:, np.argmax(values.max(axis=1))].tolist()
        above = (values > strength).mean(axis=1)
        worst = Yielding(
            load_case=load_case,
            share=float(weight @ above / weight.sum()),
            largest=float(values.max()),
            place=(x, y, z),
            strength=strength,
        )
    return worst


def yielding_words(found: Yielding | None, body: str, *, limited: bool) -> tuple[str, ...]:
    """Warning that a body yields; none where it does not.

    ``body``: such as ``"the printed solid"``. ``limited``: whether the case limits stress.
    """
    if found is None:
        return ()
    share = f"{found.share:.2%}" if found.share >= 1e-4 else "less than 0.01 %"
    judged = (
        "the limit of stress judges a percentile by volume, which such places may pass"
        if limited
        else "no limit of stress judges this case; [limits] safety_factor = 1.5 would"
    )
    return (
        f"{body} yields: in load case '{found.load_case}' {share} of its volume, away from what "
        f"supports disturb, has more than the yield strength of {found.strength:.4g} MPa, up to "
        f"{found.largest:.4g} MPa at ({', '.join(f'{c:.1f}' for c in found.place)}) mm; {judged}",
    )
