"""Renders the pages that show what was measured from the saved results: `make figures`.

The text of a page is a Jinja template in docs/templates; its tables and figures come from
benchmarks/results.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import jinja2

import ik_tables
import results

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


PAGES: dict[str, Callable[[], dict[str, Any]]] = {"ik_benchmarks": ik_benchmarks}


def render(page: str) -> str:
    """Render a page."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(DOCS / "templates"),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    return environment.get_template(f"{page}.md.jinja").render(PAGES[page]())


if __name__ == "__main__":
    for name in PAGES:
        (DOCS / f"{name}.md").write_text(render(name), encoding="utf-8")
