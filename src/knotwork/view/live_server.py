"""The server of a page that always shows the newest scene, and may edit its task."""

from __future__ import annotations

import json
import secrets
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from knotwork.view.page import meshcat_viewer, scene_page, waiting_page
from knotwork.view.page_server import Action, Answer, PageServer, Query
from knotwork.view.scene_data import ROBOT_PARTS

PULSE = 15.0
"""Interval of writes that detect a closed browser [s]."""


class LiveServer(PageServer):
    """Serves the last valid scene, and notifies browsers of new ones and of errors.

    A page that edits its task is served to anyone with its address and token.

    Args:
        title: Title of the page until there is a scene.
        port: Port; 0 for any free one.
        actions: For an editor, handlers of the page's requests by name; each gets the page's JSON.
        more_state: For an editor, function that returns further state for the page as plain data.

    Attributes:
        version: Number of the newest scene; 0 before the first one.
        scene: The newest scene, from `make_scene`; `None` before the first one.

    Raises:
        InputError: The port is in use, or not permitted; or the package `meshcat` is not
            installed.
    """

    def __init__(
        self,
        title: str,
        port: int = 0,
        actions: Mapping[str, Action] | None = None,
        more_state: Callable[[], Mapping[str, Any]] = dict,
    ) -> None:
        meshcat_viewer()
        super().__init__("", port)
        self.routes = {
            "/": self._page,
            "/scene": self._newest_scene,
            "/changes": lambda _: ("text/event-stream", self._changes()),
        }
        self.version = self._robot_version = 0
        self.scene: dict[str, Any] | None = None
        self._title, self._more_state = title, more_state
        self._error = ""
        self._busy = False
        self._changed = threading.Condition()
        self._count = 0
        if actions is not None:
            self.actions = actions
            self.token = secrets.token_urlsafe(24)
            self.address += f"?token={self.token}"

    @property
    def scene_size(self) -> float:
        """Size of the present scene [m]."""
        return float(self.scene["size"]) if self.scene is not None else 1.0

    def show(self, scene: Mapping[str, Any]) -> None:
        """Serve another scene."""
        last, version = self.scene, self.version + 1
        if last is None or any(scene[name] is not last[name] for name in ROBOT_PARTS):
            self._robot_version = version
        self.scene = {**scene, "still": self._robot_version}
        self._set_state(version, "", busy=False)

    def refuse(self, error: str) -> None:
        """Show an error over the last good page."""
        self._set_state(self.version, error, busy=False)

    def announce_next(self) -> None:
        """Announce that the next scene is in progress; an error is shown until it is ready."""
        self._set_state(self.version, self._error, busy=True)

    def _set_state(self, version: int, error: str, *, busy: bool) -> None:
        with self._changed:
            self.version, self._error, self._busy = version, error, busy
        self.notify()

    def notify(self) -> None:
        """Send the state to all open pages."""
        with self._changed:
            self._count += 1
            self._changed.notify_all()

    def state(self) -> dict[str, Any]:
        """State for an open page."""
        state = {"version": self.version, "error": self._error, "busy": self._busy}
        return {**state, **self._more_state()}

    def _page(self, query: Query) -> Answer:
        """The whole page with the newest scene."""
        version, scene = self.version, self.scene  # in this order, because a page may be newer
        if scene is None:
            return "text/html", waiting_page(self._title, self._error)
        page = scene_page(scene, live=version, editing=bool(self.actions))
        return "text/html", page.html

    def _newest_scene(self, query: Query) -> Answer | None:
        """The parts of the newest scene that an open page does not have."""
        scene = self.scene
        if scene is None:
            return None
        if query.get("still") == str(scene["still"]):
            scene = {key: part for key, part in scene.items() if key not in ROBOT_PARTS}
        return "text/html", scene_page(scene, scripts=False).html

    def _changes(self) -> Iterator[str]:
        """Each state as an event, and a pulse if there is no change."""
        seen = -1
        while True:
            with self._changed:
                changed = self._count != seen or self._changed.wait(PULSE)
                seen = self._count
            yield f"retry: 1000\ndata: {json.dumps(self.state())}\n\n" if changed else ":\n\n"
