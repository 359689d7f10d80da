"""The map of a study in a browser: a click on a row shows its motion, or why there is none."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any
from urllib.parse import parse_qs

import numpy as np

from knotwork.errors import InputError
from knotwork.view.page import Page, asset, json_in_html, rendered
from knotwork.view.page_server import PageHandler, PageServer
from knotwork.view.study_plot import DrawnStudy

MOTIONS = 16
"""Pages of rows that are kept; others are planned again when they are asked for."""


class MapServer(PageServer):
    """Serves the map of a study, and the scenes of its rows.

    Args:
        study: A `knotwork.Study`.
        page_of: Plans a row, and gives the page of its motion.
        port: Listened on; 0 for any that is free.

    Raises:
        InputError: As `PageServer`.
    """

    def __init__(self, study: Any, page_of: Callable[[int], Page], port: int = 0) -> None:
        self.rows = len(study)
        self.page_of = lru_cache(MOTIONS)(lambda row: page_of(row).html.encode())
        super().__init__(_map(study), port, _MapHandler)


class _MapHandler(PageHandler):
    server: MapServer

    def answer_other(self, path: str, query: str) -> None:
        """Send the scene of a row, or the error of a row without a motion."""
        asked = parse_qs(query).get("row", [""])[0]
        if path != "/motion" or not asked.isdecimal() or int(asked) >= self.server.rows:
            return super().answer_other(path, query)
        try:
            self.send_text(self.server.page_of(int(asked)), "text/html")
        except InputError as error:
            self.send_text(str(error).encode(), "text/plain")


def _map(study: Any) -> str:
    """The page of the map."""
    drawn = DrawnStudy(study)
    figures = {drawn.label(name): drawn.values(name) for name in study.figures}
    data = {
        "axes": [
            {"title": one.title, "at": one.at.tolist(), "names": list(one.names)}
            for one in drawn.varied
        ],
        "grid": not drawn.dots,
        "row": study["row"],
        "values": [[str(value) for value in study[name]] for name in study.varied],
        "verdict": study["verdict"],
        "kind": drawn.kinds.tolist(),
        "message": study["message"],
        "palette": drawn.palette,
        "figures": {
            label: [float(one) if np.isfinite(one) else None for one in values]
            for label, values in figures.items()
            if np.isfinite(values).any()
        },
    }
    parts = {"style": asset("map.css"), "script": asset("map.js"), "json": json_in_html(data)}
    return rendered("map.html", parts, title=study.name, passed=study.passed, rows=len(study))
