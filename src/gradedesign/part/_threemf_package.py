"""The package of a 3MF file: its model and metadata, checked before and while unpacked."""

from __future__ import annotations

import posixpath
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol
from xml.parsers import expat

from gradedesign.errors import PartError

#: Limits of what a package may unpack to: bytes of a part, its growth, and entries.
MOST_BYTES, MOST_GROWTH, MOST_ENTRIES = 1 << 30, 100, 1000
#: The growth of parts below this size is not checked, bytes.
_SMALL = 1 << 20
_CHUNK = 1 << 20
#: Elements within each other: the formats nest a dozen, and each open one takes memory.
_DEEPEST = 100
_ROOT = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
_RELATION = "http://schemas.openxmlformats.org/package/2006/relationships}Relationship"


class Handler(Protocol):
    """Takes the elements of a part as they arrive; names are ``namespace}tag``."""

    def prefix(self, prefix: str, namespace: str) -> None:
        """Take the declaration of a prefix, before the element that makes it."""

    def start(self, name: str, attributes: dict[str, str]) -> None:
        """Take the begin of an element."""

    def text(self, data: str) -> None:
        """Take text within an element, piece by piece."""

    def end(self, name: str) -> None:
        """Take the end of an element."""


class _Relations:
    """Targets of the relations to a model."""

    def __init__(self) -> None:
        self.targets: list[str] = []

    def prefix(self, prefix: str, namespace: str) -> None: ...

    def start(self, name: str, attributes: dict[str, str]) -> None:
        if name == _RELATION and attributes.get("Type") == _ROOT:
            self.targets.append(attributes.get("Target", ""))

    def text(self, data: str) -> None: ...

    def end(self, name: str) -> None: ...


def read_package(path: Path, model: Handler, metadata: Callable[[str], Handler | None]) -> None:
    """Hand every element of a 3MF file's model and metadata to handlers.

    Parameters
    ----------
    path : Path
    model : Handler
    metadata : callable
        The handler for an entry of the package by its name, or None where it is passed over; its
        names of elements are as the file writes them, since slicers use prefixes undeclared.

    Raises
    ------
    PartError
        If the file is no package, damaged, unpacks to more than the limits, or declares entities.
    """
    with _package(path) as archive:
        relations = _Relations()
        _parse(path.name, archive, "_rels/.rels", relations)
        if len(relations.targets) != 1:
            raise PartError(
                f"{path.name}: names {len(relations.targets)} models in _rels/.rels; expected one: "
                "export it again as 3MF"
            )
        target = posixpath.normpath(relations.targets[0].lstrip("/"))
        _parse(path.name, archive, target, model)
        for name in archive.namelist():
            handler = metadata(name)
            if handler is not None:
                _parse(path.name, archive, name, handler, namespaces=False)


@contextmanager
def _package(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open a zip file; what is wrong with it or its entries names the file."""
    try:
        with zipfile.ZipFile(path) as archive:
            if len(archive.infolist()) > MOST_ENTRIES:
                raise PartError(
                    f"{path.name}: {len(archive.infolist())} entries in the package; expected at "
                    f"most {MOST_ENTRIES}"
                )
            yield archive
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise PartError(
            f"{path.name}: damaged, or not a 3MF file ({str(error)[:120]}); export or copy it again"
        ) from error
    except OSError as error:
        raise PartError(
            f"{path}: cannot be read ({error.strerror or error}); check the name, or copy it again"
        ) from error


def _parse(
    source: str, archive: zipfile.ZipFile, name: str, handler: Handler, *, namespaces: bool = True
) -> None:
    """Parse one part of the package as it is unpacked."""
    entries = {entry.filename: entry for entry in archive.infolist()}
    if name not in entries:
        raise PartError(f"{source}: the part {name} is missing in the package; export it again")
    entry = entries[name]
    limit = min(MOST_BYTES, max(_SMALL, MOST_GROWTH * entry.compress_size))
    parser = expat.ParserCreate(namespace_separator="}" if namespaces else None)
    parser.buffer_text = True
    parser.StartNamespaceDeclHandler = lambda prefix, uri: handler.prefix(prefix or "", uri or "")
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST:
            raise PartError(
                f"{source}: {name} nests elements more than {_DEEPEST} deep; it is refused"
            )
        handler.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        handler.end(tag)

    parser.StartElementHandler = start
    parser.CharacterDataHandler = handler.text
    parser.EndElementHandler = end
    parser.StartDoctypeDeclHandler = lambda *_: _refuse_doctype(source, name)
    size = 0
    try:
        with archive.open(entry) as file:
            while chunk := file.read(_CHUNK):
                size += len(chunk)
                if size > limit or entry.file_size > limit:
                    raise PartError(
                        f"{source}: {name} unpacks to more than {limit / 1e6:.0f} MB, "
                        f"{MOST_GROWTH} times its size or {MOST_BYTES / 1e9:.2g} GB; it is refused"
                    )
                parser.Parse(chunk, False)
        parser.Parse(b"", True)
    except LookupError as error:
        raise PartError(
            f"{source}: {name} is damaged in its declaration ({error}); export or copy it again"
        ) from error
    except expat.ExpatError as error:
        raise PartError(
            f"{source}: {name} is damaged in line {error.lineno} "
            f"({expat.errors.messages.get(error.code, error.code)}); export or copy it again"
        ) from error


def _refuse_doctype(source: str, name: str) -> None:
    raise PartError(f"{source}: {name} declares a document type, which 3MF forbids")
