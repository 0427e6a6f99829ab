"""The installed readers, as reading the part of a case takes them."""

from __future__ import annotations

from pathlib import Path

from gradedesign.common.values.plugins_by_name import supplied_by
from gradedesign.common.values.suggest import instead, shown
from gradedesign.design.resolve.registry import Registry, absent
from gradedesign.errors import CaseError, PluginError, blaming
from gradedesign.geometry.part.part import Reader
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.part.raw_triangles import RawTriangles
from gradedesign.geometry.part.reader import FileRequest, PartReader


def part_readers(spec: PartSpec, memory: int, registry: Registry) -> dict[str, Reader]:
    """Functions that read part files by lower-case suffix; what they raise names their plugin.

    ``spec``: its file must be one of theirs. ``memory``, bytes: that voxels may take. Raises
    `CaseError` if no reader takes the part file: lists the suffixes that are read. On reading, if
    the case states a chord tolerance for a format of triangles. Raises `PluginError`: the same,
    when a plugin that might have read it is disabled.
    """
    by_suffix = {
        suffix: _blamed(reader, registry.sources["readers"][reader.name], spec, memory)
        for reader in registry.readers.values()
        for suffix in reader.suffixes
    }
    file = spec.file
    if file is not None and file.suffix.lower() not in by_suffix:
        suffix = file.suffix.lower()
        advice = instead(suffix, sorted(by_suffix), label="readable")
        if plugin := supplied_by("suffixes", suffix):
            advice = f"{plugin}; or export it as STL"
        message = f"part.file: found {shown(file.name)}, which no installed reader takes; {advice}"
        raise absent(registry, message)
    return by_suffix


def _blamed(reader: PartReader, source: str, spec: PartSpec, memory: int) -> Reader:
    """Read a file; errors of the reader about the file are passed on."""
    chord_tolerance = spec.chord_tolerance

    def read(path: Path) -> RawTriangles:
        own = path == spec.file
        if own and chord_tolerance is not None and not reader.exact:
            raise CaseError(
                f"part.chord_tolerance: has no meaning for {path.name}, whose format holds "
                "triangles; leave it out"
            )
        if not own and reader.key:
            raise CaseError(
                f"{path.name} is read as [part.{reader.key}] says, which only [part] has; expected "
                f"a file of triangles or of CAD faces"
            )
        stated = spec.brought()
        for key in stated.keys() - {reader.key} if own else ():
            raise CaseError(
                f"part.{key}: has no meaning for {path.name}, whose format takes no such table; "
                f"leave it out"
            )
        who = f"part reader '{reader.name}' of {source} on {path.name}"
        with blaming(who, always=False):
            if reader.exact:
                raw = reader.read(path, chord_tolerance)
            elif reader.key:
                table = stated.get(reader.key)
                raw = reader.read(
                    path,
                    FileRequest(table=table, units=spec.units, memory_limit_bytes=memory),
                )
            else:
                raw = reader.read(path)
        if not isinstance(raw, RawTriangles):
            raise PluginError(f"{who} returned a {type(raw).__name__}, expected RawTriangles")
        return raw

    return read
