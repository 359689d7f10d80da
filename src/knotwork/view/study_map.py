"""The map of a study in a browser: a click on a row shows its motion, or its failure.

It is served, or one file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from knotwork.errors import InputError, KnotworkError
from knotwork.view.page import Page, asset, json_in_html, render_template, scene_page
from knotwork.view.page_server import Answer, PageServer, Query
from knotwork.view.scene_data import ROBOT_PARTS
from knotwork.view.study_plot import DrawnStudy, VariedValue
from knotwork.view.style import rounded_text

CACHED_PAGES = 16
"""Number of cached pages of rows; others are planned again."""
MOST_MAP_BYTES = 8_000_000
"""Largest size of the motions in a map as one file, to be sent by mail."""

_SceneOf = Callable[[int, Mapping[str, Any] | None], dict[str, Any]]


class MapServer(PageServer):
    """Serves the map of a study, and the scenes of its rows.

    Args:
        study: A `knotwork.Study`.
        page_of: Plans a row, and gives the page of its motion.
        port: Port; 0 for any free one.

    Raises:
        InputError: As for `PageServer`.
    """

    def __init__(self, study: Any, page_of: Callable[[int], Page], port: int = 0) -> None:
        super().__init__(_map(study), port)
        self.routes["/motion"] = self._motion
        self._rows, self._page_of = len(study), lru_cache(CACHED_PAGES)(page_of)

    def _motion(self, query: Query) -> Answer | None:
        """The scene of a row, or the error of a row without a motion."""
        row = query.get("row", "")
        if not row.isdecimal() or int(row) >= self._rows:
            return None
        try:
            return "text/html", self._page_of(int(row)).html
        except InputError as error:
            return "text/plain", str(error)


def map_page(study: Any, scene_of: _SceneOf, command: str) -> tuple[Page, int]:
    """The map as one file, with the first motions that fit, and their number.

    Args:
        study: A `knotwork.Study`.
        scene_of: Plans a row, and gives its scene; its argument is the previous scene.
        command: Command that shows the others.
    """
    first: dict[str, Any] | None = None
    page, motions, size = "", dict[int, str](), 0
    for row, verdict in zip(study["row"], study["verdict"], strict=True):
        if verdict not in ("passed", "failed"):
            continue
        try:
            scene = scene_of(row, first)
        except KnotworkError:  # of a robot that no longer exists
            continue
        if first is None:
            first, page = scene, scene_page(scene, ghosts=False).html
            size = len(page)
        elif any(scene[name] is not first[name] for name in ROBOT_PARTS):  # of another robot
            continue
        moving = {name: part for name, part in scene.items() if name not in ROBOT_PARTS}
        text = scene_page(moving, scripts=False).html
        size += len(text)
        if size > MOST_MAP_BYTES:
            break
        motions[row] = text
    more = {"command": command, "motions": motions, "page": page if motions else ""}
    return Page(study.name, _map(study, more)), len(motions)


def _map(study: Any, more: Mapping[str, Any] | None = None) -> str:
    """The page of the map; `more` for a file."""
    drawn = DrawnStudy(study)
    figures = {drawn.label(name): drawn.values(name) for name in study.figures}
    data = {
        "axes": [
            _axis(value, cells=drawn.grid and len(drawn.varied) == 2) for value in drawn.varied
        ],
        "grid": drawn.grid,
        "row": study["row"],
        "values": [[str(value) for value in study[name]] for name in study.varied],
        "verdict": study["verdict"],
        "kind": drawn.kinds.tolist(),
        "message": study["message"],
        "palette": drawn.palette,
        "figures": {
            label: [float(value) if np.isfinite(value) else None for value in values]
            for label, values in figures.items()
            if np.isfinite(values).any()
        },
        **(more or {}),
    }
    parts = {"style": asset("map.css"), "script": asset("map.js"), "json": json_in_html(data)}
    counts = {"passed": study.passed, "rows": len(study)}
    return render_template("map.html", parts, title=study.name, in_file=more is not None, **counts)


def _axis(value: VariedValue, *, cells: bool) -> dict[str, Any]:
    """A varied value for the page; numbers of a grid are cells in their order."""
    at, names = value.at.tolist(), list(value.names)
    if cells and not names:
        distinct = sorted(set(at))
        at, names = (
            [distinct.index(value) for value in at],
            [rounded_text(value, 4) for value in distinct],
        )
    return {"title": value.title, "at": at, "names": names}
