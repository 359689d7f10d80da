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
    for name in ("gallery/paper_case.webp", "ur5_deburring.webp"):
        (source / name).write_bytes(PICTURE.read_bytes())
    return build(source, folder / "built", *options)


@pytest.mark.exhaustive
def test_what_is_run_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    page = "# P\n\n$\\dot{r}_j\\dot{\\omega}\\dot{J}$\n\n```{file} a.yaml\nrobot: nobody\n```\n\n"
    page += "```{run}\n:exit: 2\nknotwork plan a.yaml\n```\n\n"
    page += "```{python}\nx = 6 * 7\nprint('the answer', x)\n```\n\n"
    page += "```{python}\n:raises: ZeroDivisionError\nx / 0\n```\n"
    page += "\n```{run}\npython examples/spline_alone.py\n```\n"  # found from any folder
    site = built(tmp_path, page)
    assert site.code == 0, site.output
    assert not list(temporary.glob("knotwork-docs-*"))
    shown = site.page("index")
    assert "SciPy loaded: False" in shown
    for words in ("robot", "nobody", "the answer 42", "ZeroDivisionError: division by zero"):
        assert words in shown
    assert "error: a.yaml: line" in shown
    dotted = "<msub><mi>𝑟\u0307</mi><mi>j</mi></msub><mi>𝜔\u0307</mi>"
    assert f'{dotted}<mover accent="true"><mi>J</mi>' in shown.replace("\n", "").replace("  ", "")


WRONG = {
    "```{run}\nknotwork plan nothing.yaml\n```": "nothing.yaml' ended with exit code 2",
    "```{run}\n:exit: 1\nknotwork planners\n```": "planners' ended with exit code 0",
    "```{python}\n1 / 0\n```": "code ended with ZeroDivisionError, not None",
    "```{python}\n:raises: KeyError\nx = 1\n```": "code ended with None, not KeyError",
    "```{picture} never.svg\nA picture\n```": "has made never.svg",
    "$\\nonsense{x}$": "nonsense",
}


@pytest.mark.exhaustive
def test_what_ends_otherwise_fails_the_build(tmp_path: Path) -> None:
    site = built(tmp_path, "# P\n\n" + "\n\n".join(WRONG))
    assert site.code != 0
    for complaint in WRONG.values():
        assert complaint in site.output
    assert site.output.count("WARNING: ") == len(WRONG)


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


@pytest.mark.exhaustive
def test_pictures_lead_to_live_pages_and_that_of_the_first_page_moves(tmp_path: Path) -> None:
    page = "# P\n\n![a](gallery/paper_case.webp)\n\n![an arm](ur5_deburring.webp)\n"
    site = built(tmp_path, page, "-D", "live_pages=1")
    assert site.code == 0, site.output
    assert site.page("index").count('href="live/paper_case.html"') == 2
    assert "Live page, 0." in site.page("index")
    assert "paper_case" in (site.folder / "live" / "paper_case.html").read_text(encoding="utf-8")

    frame = '<iframe class="live" src="live/ur5_deburring.html" title="an arm">'
    assert frame in site.page("index")
    page = (site.folder / "live" / "ur5_deburring.html").read_text(encoding="utf-8")
    assert "showScene" in page
