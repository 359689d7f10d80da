"""The documentation's own extensions: what they show, and that they complain."""

from __future__ import annotations

from pathlib import Path

import pytest
from site_build import Site, build

from shipped import SCENARIO_FILES

pytestmark = pytest.mark.usefixtures("extensions")

CONFIG = """
import sys
sys.path.insert(0, {extensions!r})
extensions = ["myst_parser", "gallery", "shown", "mathml"]
myst_enable_extensions = ["dollarmath"]
html_math_renderer = "mathml"
html_theme = "basic"
"""
DOCS = Path(__file__).parents[2] / "docs"
EXTENSIONS = str(DOCS / "extensions")
PICTURE = DOCS / "gallery" / "paper_case.webp"


def built(folder: Path, page: str, *options: str) -> Site:
    source = folder / "source"
    source.mkdir()
    (source / "conf.py").write_text(CONFIG.format(extensions=EXTENSIONS), encoding="utf-8")
    (source / "index.md").write_text(page, encoding="utf-8")
    (source / "gallery").mkdir()
    (source / "gallery" / "paper_case.webp").write_bytes(PICTURE.read_bytes())
    return build(source, folder / "built", *options)


def test_what_is_run_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    page = "# P\n\n```{file} a.yaml\nrobot: nobody\n```\n\n"
    page += "```{run}\n:exit: 2\nknotwork plan a.yaml\n```\n\n"
    page += "```{python}\nx = 6 * 7\nprint('the answer', x)\n```\n\n"
    page += "```{python}\n:raises: ZeroDivisionError\nx / 0\n```\n\n$\\dot{r}_j$\n"
    site = built(tmp_path, page)
    assert site.code == 0, site.said
    assert not list(temporary.glob("knotwork-docs-*"))
    shown = site.page("index")
    for words in ("robot", "nobody", "the answer 42", "ZeroDivisionError: division by zero"):
        assert words in shown
    assert "error: a.yaml: line" in shown
    assert "<msub><mi>𝑟\u0307</mi>" in shown.replace("\n", "").replace("  ", "")


WRONG = {
    "```{run}\nknotwork plan nothing.yaml\n```": "nothing.yaml' ended with exit code 2",
    "```{run}\n:exit: 1\nknotwork planners\n```": "planners' ended with exit code 0",
    "```{python}\n1 / 0\n```": "code ended with ZeroDivisionError, not None",
    "```{python}\n:raises: KeyError\nx = 1\n```": "code ended with None, not KeyError",
    "```{picture} never.svg\nA picture\n```": "has made never.svg",
    "$\\nonsense{x}$": "nonsense",
}


def test_what_ends_otherwise_fails_the_build(tmp_path: Path) -> None:
    site = built(tmp_path, "# P\n\n" + "\n\n".join(WRONG))
    assert site.code != 0
    for complaint in WRONG.values():
        assert complaint in site.said
    assert site.said.count("WARNING: ") == len(WRONG)


def test_blocks_in_docstrings_are_literal() -> None:
    import docstrings

    lines = [
        "Words:",
        "",
        "    y = x + 1",
        "",
        "More.",
        "",
        "Args:",
        "    x: A number",
        "        on.",
    ]
    docstrings.show_blocks(None, "", "", None, None, lines)
    assert lines[:5] == ["Words:", "", ".. code-block:: python", "", "    y = x + 1"]
    assert lines[-3:] == ["Args:", "    x: A number", "        on."]


def test_names_that_share_a_description_get_one_each() -> None:
    import docstrings

    lines = [
        "",
        ":ivar lower, upper: Limits [rad],",
        "             shape (d,).",
        ":ivar c: Another.",
    ]
    docstrings.split_names(None, "", "", None, None, lines)
    assert [line for line in lines if line] == [
        ":ivar lower: Limits [rad],",
        "             shape (d,).",
        ":ivar upper: Limits [rad],",
        "             shape (d,).",
        ":ivar c: Another.",
    ]


def test_types_are_said_in_words() -> None:
    from schema_tables import accepted

    number = {"type": "number", "minimum": -1e12, "maximum": 1e12}
    positive = {"type": "number", "exclusiveMinimum": 0, "maximum": 1e12}
    vector = {"type": "array", "items": number, "minItems": 3, "maxItems": 3}
    assert accepted(positive) == "positive number"
    assert accepted({"anyOf": [vector, {"type": "null"}]}) == "list of 3 numbers"
    assert accepted({"type": "array", "items": vector, "minItems": 3, "maxItems": 3}) == (
        "list of 3 lists of 3 numbers"
    )
    assert accepted({"oneOf": [{"const": "zero"}, {"$ref": "#/$defs/Part"}]}) == "`zero` or {Part}"
    assert accepted({"type": "object", "additionalProperties": positive}) == (
        "mapping of names to positive numbers"
    )


def test_a_colon_in_what_is_returned_is_part_of_a_sentence() -> None:
    import docstrings

    given = [
        "Args:",
        "    x: A number.",
        "",
        "Returns:",
        "    The plan: whole.",
        "",
        "Raises:",
        "    E: Not.",
    ]
    lines = list(given)
    docstrings.hide_colons(None, "", "", None, None, lines)
    assert [i for i, line in enumerate(lines) if line != given[i]] == [4]
    assert ":" not in lines[4]
    docstrings.show_colons(None, "", "", None, None, lines)
    assert lines == given


def test_signatures_name_types_by_their_short_names() -> None:
    import docstrings

    shown = docstrings.name_aliases(
        None, "", "", None, None, "(x: TypeAliasForwardRef('ArrayLike') | None)", ""
    )
    assert shown == ("(x: ArrayLike | None)", "")


def test_unwrapped_lines_of_help_are_literal() -> None:
    import docstrings

    lines = ["Formats:", "", "| ros2   YAML", "|          more", "", "End."]
    docstrings.show_tables(None, None, lines)
    assert [line for line in lines if line] == [
        "Formats:",
        ".. code-block:: none",
        "    ros2   YAML",
        "             more",
        "End.",
    ]


def test_private_parameters_are_left_out() -> None:
    from docstrings import hide_private

    one = "(waypoints: JointWaypoints, words: tuple[str, ...] = (), _explain: Any = None)"
    assert hide_private(one) == "(waypoints: JointWaypoints, words: tuple[str, ...] = ())"
    assert hide_private("(_explain: Any = None)") == "()"
    for other in ("(x: FloatArray, y_0: float)", "()", ""):
        assert hide_private(other) == other


@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        ({"exclusiveMinimum": 0}, "positive number"),
        ({"exclusiveMinimum": 0, "maximum": 0.5}, "positive number up to 0.5"),
        ({"exclusiveMinimum": 1, "exclusiveMaximum": 2}, "number between 1 and 2"),
        ({"minimum": 0}, "number, not negative"),
        ({"minimum": -1e12, "maximum": 1e12}, "number"),
    ],
)
def test_bounds_of_numbers_are_said(bounds: dict[str, float], words: str) -> None:
    from schema_tables import accepted

    assert accepted({"type": "number", **bounds}) == words


def test_examples_are_found_from_any_folder(tmp_path: Path) -> None:
    site = built(tmp_path, "# P\n\n```{run}\npython examples/spline_alone.py\n```\n")
    assert site.code == 0, site.said
    assert "SciPy loaded: False" in site.page("index")


def test_the_gallery_has_every_scenario_and_robot_and_its_picture() -> None:
    import knotwork as kw

    page = (DOCS / "gallery.md").read_text(encoding="utf-8")
    pictures = {f"gallery/{path.name}" for path in (DOCS / "gallery").iterdir()}
    assert {part.split(")")[0] for part in page.split("](")[1:]} == pictures
    robots = kw.robot_names()
    for name in (*SCENARIO_FILES, *robots):
        assert f"### {name}\n" in page
        if name in robots:
            assert f"gallery/robot_{name}.webp" in pictures
        else:
            assert f"gallery/{name}.webp" in pictures
    assert all((DOCS / name).stat().st_size < 50_000 for name in pictures)


def test_a_picture_of_the_gallery_leads_to_its_live_page(tmp_path: Path) -> None:
    site = built(tmp_path, "# P\n\n![a](gallery/paper_case.webp)\n", "-D", "live_pages=1")
    assert site.code == 0, site.said
    assert site.page("index").count('href="live/paper_case.html"') == 2
    assert "Live page, 0." in site.page("index")
    assert "paper_case" in (site.folder / "live" / "paper_case.html").read_text(encoding="utf-8")
