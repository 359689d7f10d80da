"""What the README says is true: its scenario, its Python, its figures."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

import knotwork as kw
from browser import new_tab
from command_line import Command
from texts import written

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_task_has_the_output_shown(tmp_path: Path, run: Command) -> None:
    (text,), (shown,) = blocks("yaml"), blocks("text")
    (tmp_path / "glue.yaml").write_text(text, encoding="utf-8")
    (command,) = re.findall(r"^    \$ knotwork (.+)$", README, re.MULTILINE)
    assert run(*command.split()).done() == shown
    assert max(map(len, shown.splitlines())) <= 80
    (plot,) = re.findall(r"^    knotwork (plot .+)$", README, re.MULTILINE)
    assert run(*plot.split()).code == 0
    drawn, kept = imread(tmp_path / "joints.png"), imread(ROOT / "docs/glue.png")
    assert drawn.shape == kept.shape
    assert np.abs(drawn - kept).mean() < 0.01  # letters and lines are a tenth of it


def test_the_picture_is_of_the_demo_with_its_figures(knotwork: Command) -> None:
    ((picture, caption),) = re.findall(r"\]\(docs/(\w+)\.webp\)\n\n\*(.+)\*", README)
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert f"$(BIN)/knotwork plan scenarios/{picture}.yaml" in makefile
    shown = " ".join(knotwork("plan", picture).out.split())
    for figure in re.findall(r"\d+\.\d+", caption):
        assert re.search(rf"\b{re.escape(figure)} (of|to|mm/s)", shown), figure


def test_pictures_of_the_page_say_what_the_page_says(chromium: Any, tmp_path: Path) -> None:
    """Its verdict, figures and legend; `make pictures` keeps them in the pictures."""
    tab = new_tab(chromium, viewport={"width": 1280, "height": 760})
    page = kw.plan("ur5_deburring").view().save(tmp_path / "scene.html")
    tab.goto(page.as_uri() + "#paused")
    tab.wait_for_selector("html[data-ready=true]", state="attached")
    written = "\n".join(tab.inner_text(f"#{part}") for part in ("head", "legend"))
    tab.context.close()
    assert "passed" in written
    with Image.open(ROOT / "docs/scene.png") as picture:
        assert picture.info["words"] == written
    with Image.open(ROOT / "docs/ur5_deburring.webp") as moving:
        assert moving.info["xmp"].decode() == written


def test_its_pictures_are_there_and_light() -> None:
    for name in re.findall(r"!\[.+?\]\((.+?)\)", README):
        assert (ROOT / name).stat().st_size < 2e6
    for name in re.findall(r"\]\((?!http)([^)#]+)\)", README):
        assert (ROOT / name).exists(), name


def test_the_python_examples_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks("python"):
        exec(block, names)
    assert (tmp_path / "result" / "trajectory.json").is_file()


def test_the_commands_exist() -> None:
    from knotwork.cli.main import cli

    shown = set(re.findall(r"^    (?:\$ )?knotwork (\w+)", README, re.MULTILINE))
    assert shown >= {"plan", "check", "view"}
    assert shown <= set(cli.commands)


def test_how_near_the_tool_stays_to_edge_and_speed() -> None:
    figures = re.search(r"at ([\d.]+) to ([\d.]+) mm/s and at most ([\d.]+) mm off", README)
    slowest, fastest, most_off = map(float, figures.groups())
    plan = kw.plan("ur5_deburring")
    robot = plan.joints.robot
    time = np.linspace(5, 11, 3001)  # from edge start to edge end
    q, v = plan.trajectory.position(time), plan.trajectory.velocity(time)
    place = np.array([robot.forward(row).translation for row in q])
    speed = np.array([np.linalg.norm(robot.twist(*row).linear) for row in zip(q, v, strict=True)])
    line = (place[-1] - place[0]) / np.linalg.norm(place[-1] - place[0])
    off = np.linalg.norm(np.cross(place - place[0], line), axis=1)
    assert 1e3 * off.max() <= most_off + 5e-5  # half of the last digit that is shown
    assert slowest - 5e-3 <= 1e3 * speed.min()
    assert 1e3 * speed.max() <= fastest + 5e-3
    proved = {one.quantity: one for one in plan.report.findings if one.subject == "path"}
    for quantity, most in (
        ("path_deviation", most_off + 5e-5),
        ("path_speed", fastest - 50 + 5e-3),
    ):
        found = proved[quantity]
        assert found.proof == "bounded"
        assert 1e3 * found.value <= most


def test_recipe_for_a_urdf_works_as_written(tmp_path: Path, run: Command) -> None:
    page = (ROOT / "docs" / "recipes.md").read_text(encoding="utf-8")
    sections = {part.partition("\n")[0]: part for part in page.split("\n## ")}
    urdf = sections["Your own URDF, with meshes"]
    assert ":hidden:" not in urdf
    for name, text in re.findall(r"```{file} (\S+)\n(.*?)```", urdf, re.DOTALL):
        written(tmp_path / name, text)
    (commands,) = re.findall(r"```{run}\n(.*?)```", urdf, re.DOTALL)
    for command in commands.splitlines():
        ran = run(*command.split()[1:])
        assert (ran.code, ran.err) == (0, "")
        assert "warning" not in ran.out
