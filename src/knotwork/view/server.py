"""A page served to a browser on the same machine, until it is told to stop."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import sys
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from knotwork.errors import InputError

HOST = "127.0.0.1"
"""Only this machine can reach the page."""
NAMES = (HOST, "localhost", "[::1]")
"""A page of a stranger could give its own name this address, and read what is answered to it."""


class PageServer(ThreadingHTTPServer):
    """Serves one page; no other process is started.

    Attributes:
        address: Where a browser finds the page.
    """

    daemon_threads = True
    # A port on which another program listens must be an error, on every system.
    allow_reuse_address = sys.platform != "win32"

    def __init__(self, page: str, port: int = 0, handler: type[PageHandler] | None = None) -> None:
        """Listen on a port, by default any that is free.

        Raises:
            InputError: The port is in use, or may not be listened on.
        """
        self.page = page.encode("utf-8")
        try:
            super().__init__((HOST, port), handler or PageHandler)
        except OSError as error:
            why = (
                "is in use"
                if error.errno == errno.EADDRINUSE
                else f"can't be used: {error.strerror}"
            )
            raise InputError(
                f"port {port} {why}; give another with --port, or leave it out for one that is free"
            ) from error
        self.address = f"http://{HOST}:{self.server_port}/"

    def whole_page(self) -> bytes:
        """The page as it is sent."""
        return self.page

    def handle_error(self, request: object, client_address: object) -> None:
        """Say nothing of a connection that broke; everything else is shown as ever."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]


class PageHandler(BaseHTTPRequestHandler):
    """Answers with the server's page, and to nobody but browsers on this machine."""

    server: PageServer

    def do_GET(self) -> None:
        """Answer with the page."""
        self._answer(with_page=True)

    def do_HEAD(self) -> None:
        """Answer without it."""
        self._answer(with_page=False)

    def _answer(self, *, with_page: bool) -> None:
        # A browser may reload or close in the middle of the page.
        with contextlib.suppress(ConnectionError):
            host = self.headers.get("Host", HOST)  # browsers always say it
            if re.sub(r":\d*$", "", host).lower() not in NAMES:
                self.send_error(HTTPStatus.MISDIRECTED_REQUEST)
                return
            if self.path.partition("?")[0] == "/":
                self.send_text(self.server.whole_page(), "text/html", whole=with_page)
            else:
                self.answer_other()

    def send_text(self, text: bytes, kind: str, *, whole: bool = True) -> None:
        """Send text in UTF-8, or only what is said of it."""
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(text)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        if whole:
            self.wfile.write(text)

    def answer_other(self) -> None:
        """Answer to a path that is not the page's."""
        self.send_error(HTTPStatus.NOT_FOUND)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing: a log is no part of what was asked for."""


def open_browser(address: str) -> bool:
    """Open an address in the user's browser; whether there was one to open it in.

    Without a display nothing is tried, so that no browser takes over the terminal.
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
