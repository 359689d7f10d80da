"""The map of a study, served or as one file; a click on a row shows its motion or its failure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from knotwork.errors import InputError
from knotwork.view.page import Page, asset, json_in_html, render_template
from knotwork.view.page_server import Answer, PageServer, Query
from knotwork.view.style import printable, rounded_text, shorten_names

CACHED_PAGES = 16
"""Number of cached pages of rows; others are planned again."""
PASSED_ROW = "passed"
PASSED_COLOUR, OTHER_COLOUR = "#009E73", "#B8B8B8"
REASON_COLOURS = ("#D55E00", "#404040", "#E69F00", "#56B4E9", "#CC79A7", "#F0E442", "#0072B2")
"""Colours of reasons, the most frequent first; they also differ in lightness.

Other reasons share `OTHER_COLOUR`.
"""


class MapServer(PageServer):
    """Serves the map of a study, and the scenes of its rows.

    Args:
        study: A `knotwork.Study`.
        page_of: Function that plans a row and returns the page of its motion.
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


def map_page(study: Any, command: str) -> Page:
    """The map as one file, without motions.

    Args:
        study: A `knotwork.Study`.
        command: Command that serves the map with its motions.
    """
    return Page(study.name, _map(study, command))


def _map(study: Any, command: str = "") -> str:
    """The page of the map; a file names the command that shows the motions."""
    pairs = zip(study["verdict"], study["reason"], strict=True)
    kinds = [verdict if verdict == PASSED_ROW else reason for verdict, reason in pairs]
    grid = len(study.columns_by_axis) != 1  # otherwise values vary together, like random samples
    columns = [column for axis in study.columns_by_axis for column in axis]
    figures = {name: _figure(study, name, kinds) for name in study.figures}
    data = {
        "axes": [_axis(study, column, cells=grid and len(columns) == 2) for column in columns],
        "grid": grid,
        "row": study["row"],
        "values": [[str(value) for value in study[name]] for name in study.varied],
        "verdict": study["verdict"],
        "kind": kinds,
        "message": study["message"],
        "palette": _palette(kinds),
        "figures": {
            _label(study, name): values
            for name, values in figures.items()
            if any(value is not None for value in values)
        },
        "command": command,
    }
    parts = {"style": asset("map.css"), "script": asset("map.js"), "json": json_in_html(data)}
    counts = {"passed": study.passed, "rows": len(study)}
    return render_template("map.html", parts, title=study.name, in_file=bool(command), **counts)


def _palette(kinds: list[str]) -> dict[str, str]:
    """A colour for passing rows, and for each of the reasons, most frequent first."""
    reasons = [kind for kind, _ in Counter(kinds).most_common() if kind != PASSED_ROW]
    colours = {PASSED_ROW: PASSED_COLOUR} | dict.fromkeys(reasons, OTHER_COLOUR)
    return colours | dict(zip(reasons, REASON_COLOURS, strict=False))


def _label(study: Any, name: str) -> str:
    """Title of a figure, with its unit."""
    figure = study.figures[name]
    unit = study.units.shown(0.0, figure.unit)[1]
    return f"{figure.title} [{unit}]" if unit else str(figure.title)


def _figure(study: Any, name: str, kinds: list[str]) -> list[float | None]:
    """A figure of passing rows in the displayed unit; `None` for other rows."""
    factor = study.units.shown(1.0, study.figures[name].unit)[0]
    return [
        factor * value if kind == PASSED_ROW and value is not None and np.isfinite(value) else None
        for kind, value in zip(kinds, study[name], strict=True)
    ]


def _axis(study: Any, column: str, *, cells: bool) -> dict[str, Any]:
    """An axis of the map; words, and the numbers of a grid, become the indices of cells."""
    values = study[column]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        title = printable(study.titles[column])
        if not cells:
            return {"title": title, "at": values, "names": []}
        distinct = sorted(set(values))
        names = [rounded_text(value, 4) for value in distinct]
    else:
        title = printable(column)
        values = [str(value).lower() if isinstance(value, bool) else str(value) for value in values]
        distinct = list(dict.fromkeys(values))
        names = shorten_names(distinct, 24)
    return {"title": title, "at": [distinct.index(value) for value in values], "names": names}
