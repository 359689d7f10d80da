"""The gallery: what its pictures show, planned, and a page with the motion behind each picture.

`make docs` makes the pages (`-D live_pages=1`), some 4 MB each; without them a picture is a
picture. A picture is of the scenario or the robot that its file is named after.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

import knotwork as kw
from knotwork.view import report_page
from knotwork.view.page import Page

FOLDER = "gallery/"
PAGES = "live"
FIRST = "ur5_deburring.webp"  # on the first page
ROBOT = "robot_"


def at_home(robot: str) -> kw.Plan:
    """A robot that stands at home for a second."""
    home = {"joints": "home"}
    strong = {"effort": 1e6}  # nothing is to be red
    return kw.plan(
        {"name": robot, "robot": robot, "limits": strong, "waypoints": [home, {**home, "after": 1}]}
    )


def live_page(name: str) -> Page:
    """The page behind a picture: the scene, or where there is no arm the report.

    Args:
        name: Of the picture's file, without its ending.
    """
    plan = at_home(name[len(ROBOT) :]) if name.startswith(ROBOT) else kw.plan(name)
    return plan.view() if plan.joints.robot is not None else report_page(plan)


def link_pages(app: Sphinx, document: nodes.document) -> None:
    """Make the page behind each picture of the gallery, and link them."""
    if not app.config.live_pages:
        return
    for picture in list(document.findall(nodes.image)):
        if picture["uri"] == FIRST:
            _let_move(app, picture)
        if not picture["uri"].startswith(FOLDER):
            continue
        name = Path(picture["uri"]).stem
        path = live_page(name).save(Path(app.outdir) / PAGES / f"{name}.html")
        address = f"{PAGES}/{name}.html"
        link = nodes.reference("", "", refuri=address, internal=True)
        picture.replace_self(link)
        link += picture
        words = f"Live page, {path.stat().st_size / 1e6:.1f} MB"
        said = nodes.paragraph("", "", nodes.reference("", words, refuri=address, internal=True))
        around = link.parent
        around.parent.insert(around.parent.index(around) + 1, said)


def _let_move(app: Sphinx, picture: nodes.image) -> None:
    """Show the motion itself, in a frame, in place of its picture."""
    name = Path(picture["uri"]).stem
    page = Path(app.outdir) / PAGES / f"{name}.html"
    if not page.is_file():
        live_page(name).save(page)
    frame = f'<iframe class="live" src="{PAGES}/{name}.html" title="{picture["alt"]}"></iframe>'
    picture.replace_self(nodes.raw("", frame, format="html"))


def setup(app: Sphinx) -> dict[str, Any]:
    """Follow the build's pictures."""
    app.add_config_value("live_pages", False, "env", types=[bool, str])
    app.connect("doctree-read", link_pages)
    return {"version": "1", "parallel_read_safe": False}
