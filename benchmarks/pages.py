"""Renders the pages that show what was measured, from the saved results.

The text of a page is a Jinja template in docs/templates; its tables and figures come from
benchmarks/results. The pages of benchmarks are rendered whenever the site is built; `make figures`
renders the page on planners, which the repository shows too, and the figures.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import jinja2

import collision
import ik_tables
import paths
import planner_picture
import planner_tables
import results
import speed
import timing
import ways_tables

DOCS = Path(__file__).parents[1] / "docs"


def ik_benchmarks() -> dict[str, Any]:
    """What the page on inverse kinematics shows."""
    names = ("ik_success", "ik_branches", "ik_speed")
    data = {name: results.load(name) for name in names}
    tables = [table for name in names for table in ik_tables.tables(name, data[name])]
    return {
        **dict(zip(("success", "singular", "branches", "speed"), tables, strict=True)),
        "poses": data["ik_speed"]["poses"],
        "figures": ik_tables.Figures(data["ik_speed"]),
    }


def planners() -> dict[str, Any]:
    """What the pages on planners show."""
    data = results.load("planners")
    tables, figures = planner_tables.tables(data), planner_tables.Figures(data)
    kinds, ratios = len(planner_tables.KINDS), len(planner_tables.RATIOS)
    shown = {"tasks": data["tasks"], "first": data["first"], "cases": kinds * ratios}
    return {**shown, "tables": tables, "f": figures}


def path_benchmarks() -> dict[str, Any]:
    """What the page on tool paths and other curves shows."""
    data = results.load("paths")
    proved, *curves, long, free = paths.tables(data)
    last = data["long"][-1]
    return {"proved": proved, "curves": curves, "long": long, "last": last, "free": free}


def collision_benchmarks() -> dict[str, Any]:
    """What the page on the cost of the proof of collisions shows."""
    data = results.load("collision")
    cost, rods = collision.tables(data)
    proof, samples = (one["found"] for one in data["rods"])
    return {"cost": cost, "rods": rods, "proof": proof, "samples": samples}


def speed_benchmarks() -> dict[str, Any]:
    """What the page on the time that plans take shows."""
    names = ("plans", "starts", "lines", "evaluated")
    return dict(zip(names, speed.tables(results.load("speed")), strict=True))


def timing_benchmarks() -> dict[str, Any]:
    """What the page on minimum times shows."""
    data = results.load("timing")
    names = ("random", "sizes", "torques", "shipped")
    tables = dict(zip(names, timing.tables(data), strict=True))
    return {"tasks": data["tasks"], **tables}


def ways_benchmarks() -> dict[str, Any]:
    """What the page on ways round obstacles shows."""
    data = results.load("ways")
    names = ("solved", "durations", "times", "judged")
    return {
        "f": ways_tables.figures(data),
        **dict(zip(names, ways_tables.tables(data), strict=True)),
    }


PAGES: dict[str, Callable[[], dict[str, Any]]] = {
    "planners": planners,
    "planner_benchmarks": planners,
    "ik_benchmarks": ik_benchmarks,
    "path_benchmarks": path_benchmarks,
    "timing_benchmarks": timing_benchmarks,
    "collision_benchmarks": collision_benchmarks,
    "speed_benchmarks": speed_benchmarks,
    "ways_benchmarks": ways_benchmarks,
}


def render(page: str) -> str:
    """Render a page."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(DOCS / "templates"),
        undefined=jinja2.StrictUndefined,
    )
    text = environment.get_template(f"{page}.md.jinja").render(PAGES[page]())
    return text.rstrip() + "\n"


def write(page: str) -> None:
    """Write a page into docs, where it has changed."""
    path, text = DOCS / f"{page}.md", render(page)
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write("planners")
    planner_picture.draw(results.load("planners"), DOCS / "planners_peaks.svg")
    paths.figure(results.load("paths"), DOCS / "path_deviation.svg")
