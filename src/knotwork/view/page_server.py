"""Pages served to browsers on the same machine: one page, or the newest version of one."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import sys
import threading
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, cast
from urllib.parse import parse_qs

from knotwork.errors import InputError
from knotwork.view.page import meshcat_viewer, scene_page, waiting_page
from knotwork.view.scene_data import ROBOT_PARTS

HOST = "127.0.0.1"
"""Only this machine can reach the page."""
NAMES = (HOST, "localhost", "[::1]")
"""Other host names are refused: a foreign page could map its name to this address to read it."""


class PageServer(ThreadingHTTPServer):
    """Serves one page; no other process is started.

    Attributes:
        address: Address for a browser.
    """

    daemon_threads = True
    # A port on which another program listens must be an error, on every system.
    allow_reuse_address = sys.platform != "win32"

    def __init__(self, page: str, port: int = 0, handler: type[PageHandler] | None = None) -> None:
        """Listen on a port, by default any free one.

        Raises:
            InputError: The port is in use, or not permitted.
        """
        self.page = page.encode("utf-8")
        try:
            super().__init__((HOST, port), handler or PageHandler)
        except OSError as error:
            used = error.errno == errno.EADDRINUSE
            why = "is in use" if used else f"can't be used: {error.strerror}"
            raise InputError(
                f"port {port} {why}; give another with --port, or leave it out for a free one"
            ) from error
        self.address = f"http://{HOST}:{self.server_port}/"

    def whole_page(self) -> bytes:
        """The page as sent."""
        return self.page

    def admits(self, query: str) -> bool:
        """Whether requests with this query are answered."""
        return True

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignore broken connections; report all other errors."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]


class PageHandler(BaseHTTPRequestHandler):
    """Answers with the server's page, only to browsers on this machine."""

    server: PageServer

    def do_GET(self) -> None:
        """Answer with the page."""
        self._answer(with_page=True)

    def do_HEAD(self) -> None:
        """Answer without the page."""
        self._answer(with_page=False)

    def _answer(self, *, with_page: bool) -> None:
        # A browser may reload or close in the middle of the page.
        with contextlib.suppress(ConnectionError):
            path, _, query = self.path.partition("?")
            if not self.admitted(query):
                return
            if path == "/":
                self.send_text(self.server.whole_page(), "text/html", whole=with_page)
            else:
                self.answer_other(path, query)

    def admitted(self, query: str) -> bool:
        """Whether a request is admitted; if not, an error is sent."""
        host = self.headers.get("Host", HOST)  # browsers always send it
        if re.sub(r":\d*$", "", host).lower() not in NAMES:
            self.send_error(HTTPStatus.MISDIRECTED_REQUEST)
            return False
        if not self.server.admits(query):
            self.send_error(HTTPStatus.FORBIDDEN)
            return False
        return True

    def send_text(self, text: bytes, kind: str, *, whole: bool = True) -> None:
        """Send text in UTF-8, or only its headers."""
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(text)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        if whole:
            self.wfile.write(text)

    def answer_other(self, path: str, query: str) -> None:
        """Answer to another path than the page's."""
        self.send_error(HTTPStatus.NOT_FOUND)

    def log_message(self, format: str, *args: object) -> None:
        """Write no log."""


def open_browser(address: str) -> bool:
    """Open an address in the user's browser; whether one was found.

    Nothing is tried without a display, so that no browser takes over the terminal.
    """
    import webbrowser

    if sys.platform.startswith("linux") and not any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    ):
        return False
    try:
        return webbrowser.open(address, new=2)
    except webbrowser.Error:
        return False


# Interval of writes by which a closed browser is noticed [s].
PULSE = 15.0


class LiveServer(PageServer):
    """Serves the last valid scene, and notifies browsers of new ones and of errors.

    Attributes:
        version: Number of the scene; 0 before the first one.
        scene: From `make_scene`; `None` before the first one.
        editing: Whether the page can edit its task.
    """

    editing = False

    def __init__(
        self,
        title: str,
        port: int = 0,
        *,
        ghosts: bool = True,
        handler: type[LiveHandler] | None = None,
    ) -> None:
        """Listen on a port, by default any free one; `ghosts` as for `scene_page`.

        Raises:
            InputError: The port is in use, or not permitted; or the package `meshcat` is
                not installed.
        """
        meshcat_viewer()
        super().__init__(waiting_page(title).html, port, handler or LiveHandler)
        self.version = self._still = 0
        self.scene: dict[str, Any] | None = None
        self._ghosts = ghosts
        self._error = ""
        self._busy = False
        self._changed = threading.Condition()
        self._count = 0

    def show(self, scene: Mapping[str, Any]) -> None:
        """Serve another scene."""
        last, version = self.scene, self.version + 1
        if last is None or any(scene[name] is not last[name] for name in ROBOT_PARTS):
            self._still = version
        self.scene = {**scene, "still": self._still}
        self._tell(version, "", busy=False)

    def whole_page(self) -> bytes:
        """The page at the start of following."""
        version, scene = self.version, self.scene  # in this order: a page may be newer
        if scene is None:
            return self.page
        page = scene_page(scene, ghosts=self._ghosts, live=version, editing=self.editing)
        return page.html.encode("utf-8")

    def refuse(self, error: str) -> None:
        """Show an error over the last good page."""
        self._tell(self.version, error, busy=False)

    def start(self) -> None:
        """Announce that the next version is in progress; an error stays until then."""
        self._tell(self.version, self._error, busy=True)

    def _tell(self, version: int, error: str, *, busy: bool) -> None:
        with self._changed:
            self.version, self._error, self._busy = version, error, busy
        self.notify()

    def notify(self) -> None:
        """Send the state again."""
        with self._changed:
            self._count += 1
            self._changed.notify_all()

    def state(self) -> dict[str, Any]:
        """State for an open page."""
        return {"version": self.version, "error": self._error, "busy": self._busy}

    def next_state(self, seen: int) -> tuple[int, str | None]:
        """Wait for a newer state than a seen one; its number and its JSON, `None` for none."""
        with self._changed:
            if not self._changed.wait_for(lambda: self._count != seen, timeout=PULSE):
                return seen, None
            return self._count, json.dumps(self.state())


class LiveHandler(PageHandler):
    """Answers with the newest scene, and with each state."""

    def answer_other(self, path: str, query: str) -> None:
        """Send the missing parts of the newest scene, or each state as an event."""
        server = cast(LiveServer, self.server)
        scene = server.scene
        if path == "/changes":
            self._tell_changes(server)
        elif path == "/scene" and scene is not None:
            if parse_qs(query).get("still") == [str(scene["still"])]:
                scene = {key: part for key, part in scene.items() if key not in ROBOT_PARTS}
            self.send_text(scene_page(scene, scripts=False).html.encode("utf-8"), "text/html")
        else:
            super().answer_other(path, query)

    def _tell_changes(self, server: LiveServer) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        seen = -1
        while True:
            seen, state = server.next_state(seen)
            event = ":\n\n" if state is None else f"retry: 1000\ndata: {state}\n\n"
            self.wfile.write(event.encode("utf-8"))
            self.wfile.flush()
