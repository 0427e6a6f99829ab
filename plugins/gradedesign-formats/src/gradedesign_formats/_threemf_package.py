"""The package of a 3MF file: its models and metadata, checked before and while unpacked."""

from __future__ import annotations

import posixpath
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol
from urllib.parse import unquote
from xml.parsers import expat

from gradedesign import PartError

#: Limits of what a package may unpack to: bytes of all parts, the growth of one, and entries.
#: Chosen, not measured.
MOST_BYTES, _MOST_GROWTH, _MOST_ENTRIES = 1 << 30, 100, 1000
#: The growth of parts below this size is not checked, bytes. Chosen, not measured.
_SMALL = 1 << 20
#: Bytes that are unpacked between two looks at the limits. Chosen, not measured.
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


@dataclass(slots=True, kw_only=True)
class Package:
    """An open package, of which parts are handed to handlers as they are unpacked.

    Attributes
    ----------
    source : str
        Name of the file, for messages.
    """

    source: str
    _archive: zipfile.ZipFile
    _unpacked: int = 0

    @property
    def entries(self) -> list[str]:
        """Names of all entries."""
        return self._archive.namelist()

    def models(self, of: str = "") -> list[str]:
        """Entries of the models that an entry, or the package itself, has a relation to.

        Raises
        ------
        PartError
            If a relation leads out of the package.
        """
        folder, name = posixpath.split(of)
        path = posixpath.join(folder, "_rels", f"{name}.rels")
        if of and path not in self.entries:
            return []
        relations = _Relations()
        self.parse(path, relations)
        found = [entry_name(text, f"/{folder}", self.source, path) for text in relations.targets]
        # A target is a URI, which some programs write as it is and others quoted.
        return [name if name in self.entries else unquote(name) for name in found]

    def root(self) -> str:
        """The entry of the root model.

        Raises
        ------
        PartError
            If the package names no model, or several.
        """
        found = self.models()
        if len(found) != 1:
            raise PartError(
                f"{self.source}: names {len(found)} models in _rels/.rels; expected one: export it "
                "again as 3MF"
            )
        return found[0]

    def require_related(self, root: str, placed: Sequence[str]) -> None:
        """Refuse models whose objects the root model places, but to which it has no relation."""
        missing = set(placed) - set(self.models(root) if placed else ())
        if missing:
            raise PartError(
                f"{self.source}: {root} places objects of {', '.join(sorted(missing)[:12])}, to "
                "which it has no relation in its .rels; save the file again in the slicer"
            )

    def parse(self, name: str, handler: Handler, *, namespaces: bool = True) -> None:
        """Hand every element of an entry to a handler.

        Parameters
        ----------
        namespaces : bool
            False for names of elements as the file writes them: slicers' metadata has prefixes
            that it does not declare.

        Raises
        ------
        PartError
            If the entry is missing, damaged, unpacks to more than the limits, or declares entities.
        """
        if name not in self.entries:
            raise PartError(
                f"{self.source}: the part {name} is missing in the package; export it again"
            )
        entry = self._archive.getinfo(name)
        limit = max(_SMALL, _MOST_GROWTH * entry.compress_size)
        limit = min(limit, MOST_BYTES - self._unpacked)
        parser = _parser(self.source, name, handler, namespaces=namespaces)
        size = 0
        try:
            with self._archive.open(entry) as file:
                while chunk := file.read(_CHUNK):
                    size += len(chunk)
                    if size > limit or entry.file_size > limit:
                        raise PartError(
                            f"{self.source}: {name} unpacks to more than {limit / 1e6:.0f} MB, "
                            f"{_MOST_GROWTH} times its size or what is left of "
                            f"{MOST_BYTES / 1e9:.2g} GB for all parts; it is refused"
                        )
                    parser.Parse(chunk, False)
            parser.Parse(b"", True)
        except LookupError as error:
            raise PartError(
                f"{self.source}: {name} is damaged in its declaration ({error}); export or copy it "
                "again"
            ) from error
        except expat.ExpatError as error:
            raise PartError(
                f"{self.source}: {name} is damaged in line {error.lineno} "
                f"({expat.errors.messages.get(error.code, error.code)}); export or copy it again"
            ) from error
        self._unpacked += size


@contextmanager
def open_package(path: Path) -> Iterator[Package]:
    """Open a 3MF file; what is wrong with it or its entries names the file.

    Raises
    ------
    PartError
        If the file cannot be read, is no package, damaged, or has too many entries.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            if len(archive.infolist()) > _MOST_ENTRIES:
                raise PartError(
                    f"{path.name}: {len(archive.infolist())} entries in the package; expected at "
                    f"most {_MOST_ENTRIES}"
                )
            yield Package(source=path.name, _archive=archive)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise PartError(
            f"{path.name}: damaged, or not a 3MF file ({str(error)[:120]}); export or copy it again"
        ) from error
    except OSError as error:
        raise PartError(
            f"{path}: cannot be read ({error.strerror or error}); check the name, or copy it again"
        ) from error


def entry_name(text: str, folder: str, source: str, where: str) -> str:
    """Entry of the package by a path in it, absolute or relative to a folder.

    Raises
    ------
    PartError
        If it leads out of the package.
    """
    name = posixpath.normpath(posixpath.join(folder, text).lstrip("/"))
    if name.startswith(".."):
        raise PartError(
            f"{source}: {where} leads out of the package ({text[:80]!r}); expected the name of one "
            "of its parts: export it again"
        )
    return name


def _parser(source: str, name: str, handler: Handler, *, namespaces: bool) -> expat.XMLParserType:
    """A parser that hands its elements over, and refuses deep ones and document types."""
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
    return parser


def _refuse_doctype(source: str, name: str) -> None:
    raise PartError(f"{source}: {name} declares a document type, which 3MF forbids")
