"""A scene as one self-contained page, for any browser, without a server or a network."""

from __future__ import annotations

import html
import importlib.util
import json
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knotwork import __version__
from knotwork.errors import InputError
from knotwork.files.storage import write_file
from knotwork.view.picture_files import checked_path

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

ASSETS = Path(__file__).parent / "assets"
SCRIPTS = (
    *("shapes", "arm", "surroundings", "fit", "camera", "labels", "player", "strip"),
    *("joints", "video", "live", "scene"),
)
"""Files in `assets/scene/` that make the script of the page; each may use the previous ones."""
EDITING = ("gizmo", "form", "edit")
"""Scripts of the editor."""


class Page:
    """A page of HTML; a notebook shows it inline.

    Attributes:
        title: Title of the page.
        html: The whole page, self-contained.
        warnings: Texts on parts that can't be drawn as described.
    """

    def __init__(self, title: str, text: str, warnings: tuple[str, ...] = ()) -> None:
        self.title, self.html, self.warnings = title, text, warnings

    def save(self, path: str | Path) -> Path:
        """Write the page to a file, whole or not at all; an existing one is replaced.

        Args:
            path: The file, `.html` or `.htm`; its folder is created if it does not exist.

        Raises:
            InputError: The file can't be written, is a folder, or has another suffix.
        """
        return write_file(checked_path("page", path), self.html, kind="a page")

    def _repr_html_(self) -> str:
        return iframe(self.html, height="520px")

    def __repr__(self) -> str:
        return f"<Page {self.title!r}: {len(self.html) / 1e6:.1f} MB of HTML>"


def iframe(text: str, *, height: str, name: str = "") -> str:
    """Embed a page in a frame of another page."""
    source = html.escape(text, quote=True)
    title = html.escape(name or "Knotwork scene", quote=True)
    return (
        f'<iframe title="{title}" srcdoc="{source}" '
        f'style="width: 100%; height: {height}; border: 0"></iframe>'
    )


def scene_page(
    scene: Mapping[str, Any],
    *,
    embedded: bool = False,
    autoplay: bool = True,
    live: int | None = None,
    editing: bool = False,
    scripts: bool = True,
) -> Page:
    """Put a scene on a page.

    Args:
        scene: From `make_scene`.
        embedded: Whether the page is part of another, which has the title and the verdict.
        autoplay: Whether the motion starts automatically.
        live: Number of this scene, if a `LiveServer` serves further ones.
        editing: Whether the page edits its task, with handles and forms.
        scripts: Whether to include the scripts; without them, the text only updates an open page.

    Raises:
        InputError: The package `meshcat` is not installed.
    """
    options = {"embedded": embedded, "autoplay": autoplay, "live": live, "editing": editing}
    parts = {"meshcat": "", "script": "", "style": ""}
    if scripts:
        parts["meshcat"], parts["style"] = meshcat_viewer(), asset("scene.css")
        names = [*SCRIPTS[:-1], *(EDITING if editing else ()), SCRIPTS[-1]]
        parts["script"] = "\n".join(asset(f"scene/{name}.js") for name in names)
        parts["style"] += asset("edit.css") if editing else ""
    parts |= {"json": json_in_html(scene), "options_json": json_in_html(options)}
    text = render_template("scene.html", parts, data=scene, options=options)
    return Page(scene["title"], text, tuple(scene["warnings"]))


def waiting_page(title: str, error: str) -> str:
    """Make the page that a `LiveServer` shows before the first scene; it reloads itself."""
    return render_template("waiting.html", {"style": asset("scene.css")}, title=title, error=error)


def render_template(template: str, parts: Mapping[str, str], **values: Any) -> str:
    """Fill a template with parts that are HTML already, and with values to be escaped."""
    from markupsafe import Markup

    marked = {name: Markup(part) for name, part in parts.items()}
    text = _environment().get_template(template).render(**values, **marked, version=__version__)
    return str(text)


def json_in_html(data: Mapping[str, Any]) -> str:
    """Write plain data as JSON that can't end its script element."""
    text = json.dumps(data, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


@cache
def _environment() -> Environment:
    """Jinja's environment, which escapes all values in a page."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(ASSETS),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    environment.filters["coded"] = _mark_code
    environment.filters["short"] = lambda value: f"{float(f'{value:.3g}'):g}"
    return environment


def _mark_code(text: object) -> Markup:
    """Mark words between backticks as code."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(text))))


def asset(name: str) -> str:
    """Read a file of `assets/`."""
    return (ASSETS / name).read_text(encoding="utf-8")


@cache
def meshcat_viewer() -> str:
    """Meshcat's viewer in JavaScript; its Python package is located but not loaded.

    Raises:
        InputError: The package is not installed, or has no viewer.
    """
    spec = importlib.util.find_spec("meshcat")
    for folder in (spec.submodule_search_locations or ()) if spec is not None else ():
        path = Path(folder) / "viewer" / "dist" / "main.min.js"
        if path.is_file():
            return path.read_text(encoding="utf-8").replace("</script", "<\\/script")
    raise InputError(
        "the scene needs the package meshcat, which is not installed or lacks its viewer; install "
        "it with `pip install meshcat`"
    )
