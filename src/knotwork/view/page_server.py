"""Pages served to browsers on the same machine."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import secrets
import sys
from collections.abc import Callable, Iterator, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, TypeAlias
from urllib.parse import parse_qs

from knotwork.errors import InputError, KnotworkError

HOST = "127.0.0.1"
"""Address that only this machine can reach."""
HOST_NAMES = (HOST, "localhost", "[::1]")
"""Accepted host names. With others, a foreign site could map its own name to this address."""
MAX_REQUEST_BYTES = 1_000_000
"""Maximum size of a request [bytes]."""

Query: TypeAlias = Mapping[str, str]
Answer: TypeAlias = tuple[str, str | Iterator[str]]
"""Content type, and text or parts of a stream."""
Action: TypeAlias = Callable[[Mapping[str, Any]], Mapping[str, Any]]


class PageServer(ThreadingHTTPServer):
    """Serves pages from threads of this process.

    Attributes:
        address: Address for a browser.
        routes: Functions from the query to the answer, by path; they return `None` if there is no
            answer.
        actions: Handlers of a page's requests by path; each gets and returns plain data.
        token: Secret that each query must have; empty if none is required.
    """

    daemon_threads = True
    # On every system, a port on which another program listens must be an error.
    allow_reuse_address = sys.platform != "win32"

    def __init__(self, page: str, port: int = 0) -> None:
        """Listen on a port, by default any free one.

        Raises:
            InputError: The port is in use, or not permitted.
        """
        self.routes: dict[str, Callable[[Query], Answer | None]] = {}
        self.routes["/"] = lambda query: ("text/html", page)
        self.actions: Mapping[str, Action] = {}
        self.token = ""
        try:
            super().__init__((HOST, port), PageHandler)
        except OSError as error:
            is_in_use = error.errno == errno.EADDRINUSE
            why = "is in use" if is_in_use else f"can't be used: {error.strerror}"
            raise InputError(
                f"port {port} {why}; accepted: another port, or none for a free one"
            ) from error
        self.address = f"http://{HOST}:{self.server_port}/"

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignore broken connections; report all other errors."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]


class PageHandler(BaseHTTPRequestHandler):
    """Answers with the server's pages, only to browsers on this machine."""

    server: PageServer

    def do_GET(self) -> None:
        """Answer with a page."""
        with contextlib.suppress(ConnectionError):  # a browser may reload amid the page
            admitted = self._admitted_path()
            if admitted is None:
                return
            path, query = admitted
            route = self.server.routes.get(path)
            answer = None if route is None else route(query)
            if answer is None:
                self.send_error(HTTPStatus.NOT_FOUND)
            else:
                self._send(*answer)

    def do_POST(self) -> None:
        """Handle a request of the page, and answer with JSON."""
        with contextlib.suppress(ConnectionError):
            admitted = self._admitted_path()
            size = self.headers.get("Content-Length", "")
            origin = self.headers.get("Origin")
            if admitted is None:
                return
            path, _ = admitted
            if origin not in (None, f"http://{self.headers.get('Host')}"):
                self.send_error(HTTPStatus.FORBIDDEN)
            elif path[1:] not in self.server.actions:
                self.send_error(HTTPStatus.NOT_FOUND)
            elif self.headers.get_content_type() != "application/json":
                self.send_error(HTTPStatus.UNSUPPORTED_MEDIA_TYPE)
            elif not size.isdecimal() or int(size) > MAX_REQUEST_BYTES:
                self.send_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
            else:
                answer = _act(self.server.actions[path[1:]], self.rfile.read(int(size)))
                self._send("application/json", json.dumps(answer))

    def _admitted_path(self) -> tuple[str, Query] | None:
        """Path and query of an admitted request; to others an error is sent."""
        path, _, text = self.path.partition("?")
        query = {name: values[0] for name, values in parse_qs(text).items()}
        token = self.server.token.encode()
        host = self.headers.get("Host", HOST)  # browsers always send it
        if re.sub(r":\d*$", "", host).lower() not in HOST_NAMES:
            self.send_error(HTTPStatus.MISDIRECTED_REQUEST)
        elif not secrets.compare_digest(query.get("token", "").encode(), token):
            self.send_error(HTTPStatus.FORBIDDEN)
        else:
            return path, query
        return None

    def _send(self, kind: str, content: str | Iterator[str]) -> None:
        """Send text, or the parts of a stream, in UTF-8."""
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Cache-Control", "no-store")
        if isinstance(content, str):
            parts = iter([content.encode()])
            self.send_header("Content-Length", str(len(content.encode())))
        else:
            parts = (part.encode() for part in content)
        self.end_headers()
        for part in parts:
            self.wfile.write(part)
            self.wfile.flush()

    def log_message(self, format: str, *args: object) -> None:
        """Write no log."""


def _act(action: Action, text: bytes) -> Mapping[str, Any]:
    """Return the answer of an action to the text of a request, or the error as an answer."""
    try:
        request = json.loads(text, parse_constant=_refuse)
        if not isinstance(request, dict):
            raise ValueError("not a JSON object")
        return action(request)
    except KnotworkError as error:
        return {"error": str(error)}
    except (ValueError, TypeError, LookupError, RecursionError) as error:
        return {"error": f"the page sent an invalid request: {error!r}"}


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is not a JSON number")


def open_browser(address: str) -> bool:
    """Open an address in the user's browser, and return whether one was found.

    Without a display no browser is opened, because it would take over the terminal.
    """
    import webbrowser

    has_display = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    if sys.platform.startswith("linux") and not has_display:
        return False
    try:
        return webbrowser.open(address, new=2)
    except webbrowser.Error:
        return False
