"""The server of an editor page, which alone may send requests."""

from __future__ import annotations

import contextlib
import json
import secrets
from collections.abc import Callable, Mapping
from http import HTTPStatus
from typing import Any, cast
from urllib.parse import parse_qs

from knotwork.errors import KnotworkError
from knotwork.view.page_server import LiveHandler, LiveServer

MOST_BYTES = 1_000_000
"""Largest size of a request [bytes]."""


class EditServer(LiveServer):
    """Serves an editor page to anyone with its address and token.

    Args:
        title: Title of the page until there is a scene.
        actions: Handlers of the page's requests by name; each gets the page's JSON.
        state: Gives the state of the page besides the scene, as plain data.
        port: Port; 0 for any free one.

    Raises:
        InputError: As for `LiveServer`.
    """

    editing = True

    def __init__(
        self,
        title: str,
        actions: Mapping[str, Callable[[Mapping[str, Any]], Mapping[str, Any]]],
        state: Callable[[], Mapping[str, Any]],
        port: int = 0,
    ) -> None:
        self.actions, self._more = actions, state
        self.token = secrets.token_urlsafe(24)
        super().__init__(title, port, handler=_EditHandler)
        self.address += f"?token={self.token}"

    @property
    def scene_size(self) -> float:
        """Size of the present scene [m]."""
        return float(self.scene["size"]) if self.scene is not None else 1.0

    def admits(self, query: str) -> bool:
        """Whether a query has the token."""
        given = parse_qs(query).get("token", [""])[0]
        return secrets.compare_digest(given.encode(), self.token.encode())

    def state(self) -> dict[str, Any]:
        """State of a live page, with the draft."""
        return {**super().state(), **self._more()}


class _EditHandler(LiveHandler):
    def do_POST(self) -> None:
        """Handle a request of the page, and answer with JSON."""
        with contextlib.suppress(ConnectionError):
            path, _, query = self.path.partition("?")
            host, origin = self.headers.get("Host"), self.headers.get("Origin")
            if not self.admitted(query):
                return
            size = self.headers.get("Content-Length", "")
            kind = self.headers.get_content_type()
            action = cast(EditServer, self.server).actions.get(path[1:])
            if origin not in (None, f"http://{host}"):
                self.send_error(HTTPStatus.FORBIDDEN)
            elif action is None:
                self.send_error(HTTPStatus.NOT_FOUND)
            elif kind != "application/json":
                self.send_error(HTTPStatus.UNSUPPORTED_MEDIA_TYPE)
            elif not size.isdecimal() or int(size) > MOST_BYTES:
                self.send_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
            else:
                self._do(action, self.rfile.read(int(size)))

    def _do(self, action: Callable[[Any], Any], text: bytes) -> None:
        try:
            asked = json.loads(text, parse_constant=_refuse)
            if not isinstance(asked, dict):
                raise ValueError("not a JSON object")
            answer = action(asked)
        except KnotworkError as error:
            answer = {"error": str(error)}
        except (ValueError, TypeError, LookupError, RecursionError) as error:
            answer = {"error": f"the page sent an invalid request: {error!r}"}
        cast(EditServer, self.server).notify()
        self.send_text(json.dumps(answer).encode(), "application/json")


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is not a JSON number")
