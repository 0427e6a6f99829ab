"""A page on the loopback address, made again when a file that it shows is saved."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any, Protocol

from gradedesign.errors import CaseError

_ADDRESS = "127.0.0.1"


class Page(Protocol):
    """A page to be, and the files that it was read from."""

    @property
    def read(self) -> Sequence[Path]:
        """Files that it was read from."""

    def page(self, watch: str = "") -> str:
        """The HTML; not empty, ``watch`` is what ``/state`` answers while the page holds."""


def serve_page(
    make: Callable[[], Page], *, port: int, watch: bool, on_start: Callable[[str], None]
) -> None:
    """Answer a browser on this machine until the command is interrupted.

    Raises CaseError if the port is taken.

    - ``make``: reads anew what is shown
    - ``port``: 0: any that is free
    - ``watch``: whether the page loads itself again when a file changes
    - ``on_start``: receives the address
    """
    try:
        server = _PageServer(make, port, watch=watch)
    except (OSError, OverflowError) as error:
        raise CaseError(
            f"--port {port}: cannot be served on ({error}); choose another, or leave it out for "
            f"one that is free"
        ) from None
    with server:
        server.refresh()
        on_start(f"http://{_ADDRESS}:{server.server_port}/")
        server.serve_forever()


class _PageServer(HTTPServer):
    """Serves one page; requests one after another, since pictures are drawn in one thread."""

    def __init__(self, make: Callable[[], Page], port: int, *, watch: bool) -> None:
        super().__init__((_ADDRESS, port), _Handler)
        self._make, self._watch = make, watch
        self._read: Sequence[Path] = ()
        self._made: str | None = None
        self.html = ""

    def refresh(self) -> None:
        """Make the page again if a file that it was made from has changed."""
        state = self.state()
        if state == self._made:
            return
        shown = self._make()
        if tuple(shown.read) != tuple(self._read):
            self._read = tuple(shown.read)
            state = self.state()
        # Otherwise that of before it was read: what is saved meanwhile makes it again.
        self._made = state
        self.html = shown.page(state if self._watch else "")

    def state(self) -> str:
        """A text that changes as one of the files does."""
        found = []
        for path in self._read:
            try:
                at = path.stat()
                found.append(f"{at.st_mtime_ns}-{at.st_size}")
            except OSError:
                found.append("gone")
        return " ".join(found)

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ARG002  of its base
        """End the command as any error does, but for a browser that has left."""
        error = sys.exception()
        if error is not None and not isinstance(error, ConnectionError):
            raise error


class _Handler(BaseHTTPRequestHandler):
    """Answers ``/`` with the page and ``/state`` with the state of its files."""

    server: _PageServer

    def do_GET(self) -> None:
        # A page of another site must not read what is shown under a name of its own.
        hosts = {f"{name}:{self.server.server_port}" for name in (_ADDRESS, "localhost")}
        if self.headers.get("Host") not in hosts:
            self.send_error(403)
            return
        if self.path not in ("/", "/state"):
            self.send_error(404)
            return
        if self.path == "/":
            self.server.refresh()
        content = (self.server.html if self.path == "/" else self.server.state()).encode()
        kind = "html" if self.path == "/" else "plain"
        self.send_response(200)
        self.send_header("Content-Type", f"text/{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing of requests."""
