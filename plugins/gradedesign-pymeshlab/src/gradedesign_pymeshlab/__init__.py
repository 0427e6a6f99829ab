"""Repair of part surfaces by MeshLab, for gradedesign."""

from collections.abc import Iterable

from gradedesign import Repairer, hookimpl

_PYMESHLAB = Repairer(
    name="pymeshlab",
    worker="gradedesign_pymeshlab._worker",
    options={
        "hole_edges": "most edges of a hole that is filled, 100 if not stated",
        "edge_length": "remesh isotropically to edges of this length, mm",
        "deviation": "farthest that remeshing may move the surface, mm; 1 % of edge_length if "
        "not stated",
        "triangles": "decimate to this number of triangles",
    },
)


@hookimpl
def gradedesign_repairers() -> Iterable[Repairer]:
    """Register the repairer."""
    yield _PYMESHLAB
