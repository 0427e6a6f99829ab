"""The explicit mesh on the first grid that keeps the solid and fits the memory."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

from gradedesign.errors import LatticeError, ResourceError
from gradedesign.fe.solve import predict_memory_bytes
from gradedesign.lattice.lattice import LatticeDesign
from gradedesign.verify.explicit_mesh import (
    CoarseGridError,
    ExplicitMesh,
    LargeGridError,
    dividing_spacing,
    field_volume,
    fitting_spacing,
    mesh_lattice,
    predict_unknowns,
)
from gradedesign.workspace.progress import stepping

log = logging.getLogger(__name__)

#: Where the grid of the thinnest wall does not fit the memory, one this much coarser is tried; the
#: mesh must hold its volume on it as on any other.
COARSEST = 1.25
#: What keeps this share on a finer grid, disconnected components or a difference of volume, is no
#: fault of the grid.
SAME_LOSS = 0.8


def mesh_within_budget(
    design: LatticeDesign,
    spacing: float,
    *,
    coarsest: float,
    memory_limit_bytes: float,
    bodies: int = 1,
    on_refusal: Callable[[str], None] | None = None,
) -> ExplicitMesh:
    """Mesh a design on the first grid that passes the gates and fits the memory.

    Parameters
    ----------
    design : LatticeDesign
    spacing : float, mm
        Grid spacing to begin with.
    coarsest : float, mm
        Where ``spacing`` does not fit the memory, the largest spacing to try instead.
    memory_limit_bytes : float
        Budget that the following solve must fit.
    bodies : int
        Of the part: as many components are kept.
    on_refusal : callable, optional
        Hears why a grid was refused and what comes next.

    Raises
    ------
    ResourceError
        If no grid that fits the memory passes the gates.
    LatticeError
        If the lattice falls apart on a finer grid as it does on a coarser one.
    """
    with stepping("volume of the lattice"):
        box = design.domain.upper - design.domain.lower
        volume = field_volume(design, dividing_spacing(box, spacing))
    fitting = fitting_spacing(volume, memory_limit_bytes)
    refused: list[str] = []

    def refuse(message: str) -> None:
        refused.append(message)
        log.info("%s", message)
        if on_refusal is not None:
            on_refusal(message)

    if spacing < fitting <= coarsest:
        refuse(
            f"a grid of {spacing:.4g} mm needs {_need_words(volume, spacing)}; [run] memory "
            f"{memory_limit_bytes / 1e9:.3g} GB holds {fitting:.4g} mm, with 1 % to spare "
            f"for dividing the part's box; taking that"
        )
        spacing = fitting
    before: CoarseGridError | None = None
    while True:
        try:
            made = mesh_lattice(
                design,
                spacing,
                memory_limit_bytes=memory_limit_bytes,
                bodies=bodies,
            )
            return replace(made, refused=tuple(refused))
        except LargeGridError as error:
            if before is not None or error.step * spacing > coarsest:
                raise
            refuse(f"{error}; taking {error.step * spacing:.3g} mm")
            spacing = fitting = error.step * spacing
        except CoarseGridError as error:
            if before is not None and _lost_again(before, error):
                raise LatticeError(
                    f"{error} (a coarser grid lost as much: it is the design, not its mesh; raise "
                    f"the lower density, enlarge the cells, or add a skin)"
                ) from error
            before = error
            finer = spacing * error.step
            if finer < fitting:
                raise ResourceError(
                    f"{error}; the next grid of {finer:.3g} mm needs {_need_words(volume, finer)}, "
                    f"but [run] memory is {memory_limit_bytes / 1e9:.3g} GB: allow more memory, "
                    f"raise the lower density, or use larger cells"
                ) from error
            refuse(f"{error}; refined to {finer:.3g} mm, {_need_words(volume, finer)}")
            spacing = finer


def _lost_again(coarser: CoarseGridError, finer: CoarseGridError) -> bool:
    """A finer grid loses nearly as much of the same as a coarser one did."""
    apart = coarser.disconnected > 0 and finer.disconnected > SAME_LOSS * coarser.disconnected
    return apart or (coarser.volume > 0 and finer.volume > SAME_LOSS * coarser.volume)


def _need_words(volume: float, spacing: float) -> str:
    dofs = predict_unknowns(volume, spacing)
    return f"about {dofs / 1e6:.2g} M unknowns and {predict_memory_bytes(dofs, 2) / 1e9:.2g} GB"
