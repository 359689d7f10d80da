"""A page that is served while its scenario is written, and told of each new version."""

from __future__ import annotations

import json
import threading
from http import HTTPStatus
from typing import cast

from knotwork.view.page import Page, Renewal, waiting_page
from knotwork.view.server import PageHandler, PageServer

# A browser that has gone away is noticed when it is written to [s].
PULSE = 15.0


class LiveServer(PageServer):
    """Serves the last good page, and tells browsers when there is another, or what is wrong.

    Attributes:
        version: Number of the page; 0 before there is one.
        renewal: What pages that are open need of it.
    """

    def __init__(self, title: str, port: int = 0) -> None:
        """Listen on a port, by default any that is free.

        Raises:
            InputError: The port is in use, or may not be listened on.
        """
        super().__init__(waiting_page(title).html, port, _LiveHandler)
        self.version = 0
        self.renewal: Renewal | None = None
        self._error = ""
        self._busy = False
        self._changed = threading.Condition()
        self._count = 0

    def show(self, page: Page) -> None:
        """Serve another page, made as version `version + 1`."""
        self.page = page.html.encode("utf-8")
        self.renewal = page.renewal
        self._tell(version=self.version + 1)

    def refuse(self, error: str) -> None:
        """Show an error over the last good page."""
        self._tell(error=error)

    def start(self) -> None:
        """Say that the next version is being made; an error stays until it is known."""
        self._tell(error=self._error, busy=True)

    def _tell(self, *, version: int | None = None, error: str = "", busy: bool = False) -> None:
        with self._changed:
            self.version = self.version if version is None else version
            self._error, self._busy = error, busy
            self._count += 1
            self._changed.notify_all()

    def next_state(self, seen: int) -> tuple[int, str | None]:
        """Wait for a state after one that was seen; its number and its JSON, `None` for none."""
        with self._changed:
            if not self._changed.wait_for(lambda: self._count != seen, timeout=PULSE):
                return seen, None
            state = {"version": self.version, "error": self._error, "busy": self._busy}
            return self._count, json.dumps(state)


class _LiveHandler(PageHandler):
    def answer_other(self) -> None:
        """Send parts of the newest page, or each state as a server-sent event."""
        server = cast(LiveServer, self.server)
        if self.path == "/changes":
            self._tell_changes(server)
        elif self.path == "/changing" and server.renewal is not None:
            self.send_text(server.renewal.changing.encode("utf-8"), "text/html")
        elif self.path == "/still" and server.renewal is not None:
            self.send_text(server.renewal.still.encode("utf-8"), "application/json")
        else:
            super().answer_other()

    def _tell_changes(self, server: LiveServer) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        seen = -1
        while True:
            seen, state = server.next_state(seen)
            said = ":\n\n" if state is None else f"retry: 1000\ndata: {state}\n\n"
            self.wfile.write(said.encode("utf-8"))
            self.wfile.flush()
