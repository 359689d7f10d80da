"""A scene that is served while its scenario is written; open pages are told of each new one."""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any, cast

from knotwork.view.page import json_in_html, meshcat_viewer, scene_page, waiting_page
from knotwork.view.scene import STILL
from knotwork.view.server import PageHandler, PageServer

# A browser that has gone away is noticed when it is written to [s].
PULSE = 15.0


class LiveServer(PageServer):
    """Serves the last good scene, and tells browsers when there is another, or what is wrong.

    Attributes:
        version: Number of the scene; 0 before there is one.
        scene: What is shown, from `make_scene`; `None` before there is one.
    """

    def __init__(self, title: str, port: int = 0, *, ghosts: bool = True) -> None:
        """Listen on a port, by default any that is free; `ghosts` as for `scene_page`.

        Raises:
            InputError: The port is in use, or may not be listened on; or the package `meshcat` is
                not installed.
        """
        meshcat_viewer()
        super().__init__(waiting_page(title).html, port, _LiveHandler)
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
        if last is None or any(scene[name] is not last[name] for name in STILL):
            self._still = version
        self.scene = {**scene, "still": self._still}
        self._tell(version=version)

    def whole_page(self) -> bytes:
        """The page, with which following begins."""
        version, scene = self.version, self.scene  # in this order: a page may be newer than it says
        if scene is None:
            return self.page
        return scene_page(scene, ghosts=self._ghosts, live=version).html.encode("utf-8")

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
        """Send parts of the newest scene, or each state as a server-sent event."""
        server = cast(LiveServer, self.server)
        scene = server.scene
        if self.path == "/changes":
            self._tell_changes(server)
        elif self.path == "/changing" and scene is not None:
            changing = {name: value for name, value in scene.items() if name not in STILL}
            self.send_text(scene_page(changing, scripts=False).html.encode("utf-8"), "text/html")
        elif self.path == "/still" and scene is not None:
            still = {name: scene[name] for name in (*STILL, "still")}
            self.send_text(json_in_html(still).encode("utf-8"), "application/json")
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
