"""Tables of the page on ways round obstacles, made of what `ways.py` measured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from motion_bench import KINDS
from results import Table

CONTENDERS = {"Knotwork": "knotwork", "roboplan": "roboplan"}
"""Whose motions are judged, and where they are in the results."""

ROUNDED = 1.001
"""Parts of a limit up to this are within it: they are saved with three digits."""


def tables(data: Mapping[str, Any]) -> list[Table]:
    """The tables of the page: what is solved, how long motions last, what it takes, the judge."""
    rows = data["rows"]
    groups = {kind: [row for row in rows if row["kind"] == kind] for kind in KINDS}
    groups = {kind: found for kind, found in groups.items() if found} | {"all": rows}
    solved = ("class", "problems", "ends outside limits", "solved and passed")
    lasts = ("mean [s]", "roboplan's mean [s]", "ratio", "on its polyline", "on the motion's curve")
    takes = ("first motion", "finished")
    wrong = ("motions", "collide", "exceed a limit of acceleration", "at most [times]")
    judges = [[name, *_judgement(rows, key)] for name, key in CONTENDERS.items()]
    return [
        Table("Solved", solved, [[name, *_solved(one)] for name, one in groups.items()]),
        Table(
            "Durations",
            ("class", *lasts),
            [[name, *_durations(one)] for name, one in groups.items()],
            "Means over problems that both solve; ratio to TOPP-RA: median / worst.",
        ),
        Table(
            "CPU time [s]",
            ("class", *takes),
            [[name, *_times(one)] for name, one in groups.items()],
            "First proved motion: median / 95 %; finished: median / 90 %.",
        ),
        Table("Judged every 3 ms", ("", *wrong), judges),
    ]


def figures(data: Mapping[str, Any]) -> dict[str, int]:
    """What the text of the page says of them."""
    valid = [row for row in data["rows"] if not _outside(row)]
    return {
        "outside": len(data["rows"]) - len(valid),
        "valid": len(valid),
        "passed": sum(bool(row.get("ok")) for row in valid),
    }


def _outside(row: Mapping[str, Any]) -> bool:
    """Whether a problem begins or ends outside the position limits: no motion solves it."""
    return "outside its limits" in row.get("error", "")


def _solved(rows: list[dict[str, Any]]) -> list[str]:
    outside = sum(_outside(row) for row in rows)
    passed = sum(bool(row.get("ok")) for row in rows)
    return [str(len(rows)), str(outside), f"{passed} of {len(rows) - outside}"]


def _durations(rows: list[dict[str, Any]]) -> list[str]:
    ours = [row for row in rows if row.get("knotwork")]
    both = [row for row in ours if row.get("roboplan")]
    own, others = (
        [row[key]["duration"] for row in shared]
        for key, shared in (("knotwork", both or ours), ("roboplan", both))
    )
    mean, rival = (float(np.mean(one)) if one else np.nan for one in (own, others))
    part = [
        [row["knotwork"]["duration"] / row[key] for row in ours if row.get(key)]
        for key in ("line", "curve")
    ]
    ratios = [_two(one, 100) for one in part]
    return [_number(mean), _number(rival), _number(mean / rival), *ratios]


def _times(rows: list[dict[str, Any]]) -> list[str]:
    return [
        _two([row[key] for row in rows if key in row], most)
        for key, most in (("first", 95), ("seconds", 90))
    ]


def _judgement(rows: list[dict[str, Any]], key: str) -> list[str]:
    found = [row[key] for row in rows if row.get(key)]
    over = [one["acceleration"] for one in found if one["acceleration"] > ROUNDED]
    counts = (len(found), sum(one["collides"] for one in found), len(over))
    return [*map(str, counts), _number(max(over, default=np.nan))]


def _two(values: list[float], most: int) -> str:
    """The median and a percentile."""
    if not values:
        return "–"
    return f"{_number(float(np.median(values)))} / {_number(float(np.percentile(values, most)))}"


def _number(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "–"
