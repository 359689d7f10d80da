"""The page of a task that is edited: what it asks for is done for this page alone."""

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
"""Of what a page asks for."""


class EditServer(LiveServer):
    """Serves a page that edits, to whoever has the address with its token.

    Args:
        title: Of the page until there is a scene.
        actions: By name what the page can ask for; each is given the page's JSON.
        state: Gives what the page shows besides the scene, as plain data.
        port: Listened on; 0 for any that is free.

    Raises:
        InputError: As `LiveServer`.
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
        """Extent of the scene that is shown [m]."""
        return float(self.scene["size"]) if self.scene is not None else 1.0

    def admits(self, query: str) -> bool:
        """Whether a query has the token."""
        given = parse_qs(query).get("token", [""])[0]
        return secrets.compare_digest(given.encode(), self.token.encode())

    def state(self) -> dict[str, Any]:
        """As for any live page, and the draft."""
        return {**super().state(), **self._more()}


class _EditHandler(LiveHandler):
    def do_POST(self) -> None:
        """Do what the page asks for, and answer with JSON."""
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
                raise ValueError("no JSON object")
            answer = action(asked)
        except KnotworkError as error:
            answer = {"error": str(error)}
        except (ValueError, TypeError, LookupError, RecursionError) as error:
            answer = {"error": f"the page asked for what is not understood: {error!r}"}
        cast(EditServer, self.server).notify()
        self.send_text(json.dumps(answer).encode(), "application/json")


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")
