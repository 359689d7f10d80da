"""`knotwork plot`: files, words and exit codes; pictures with much in them are still legible."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figures import QUANTITIES, legend_words, lines, outside, overlaps, waypoint_names
from matplotlib.figure import Figure

import knotwork as kw
from command_line import Command
from knotwork import Plan
from knotwork.errors import InputError
from knotwork.view import plot_joints, plot_tool, save_figure
from shipped import SCENARIO_FILES
from sweeps import first_of, mostly_exhaustive
from texts import written

START = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
"""First bytes of pictures by suffix."""


def commands_of_the_figures(help_text: str) -> list[list[str]]:
    """The commands that the help gives for the paper's figures."""
    joined = help_text.replace("\\\n", " ")
    return [
        line.split("knotwork plot ")[1].split()
        for line in joined.splitlines()
        if "knotwork plot paper_case" in line
    ]


def test_commands_of_the_help_draw_the_figures_of_the_paper(run: Command, tmp_path: Path) -> None:
    commands = commands_of_the_figures(run("plot", "--help").out)
    assert len(commands) == 4
    for arguments in commands:
        run("plot", *arguments).done()
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {f"figure{number}.png" for number in (12, 13, 14, 15)}


def test_picture_is_named_after_scenario(run: Command, tmp_path: Path) -> None:
    ran = run("plot", "paper_case")
    assert (ran.code, ran.err) == (0, "")
    assert ran.out == "wrote paper_case.png\n"
    assert (tmp_path / "paper_case.png").read_bytes().startswith(START[".png"])
    ran = run("plot", "planar2_closed_form", "--tool")
    assert ran.out == "wrote planar2_closed_form_tool.png\n"
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(("options", "unit"), [((), "deg/s"), (("--radians",), "rad/s")])
def test_angles_are_in_the_units_of_the_scenario(
    knotwork: Command, tmp_path: Path, options: tuple[str, ...], unit: str
) -> None:
    out = tmp_path / "a.svg"
    shown = ("ur5_deburring", "--joints=elbow_joint", "--quantities", "velocity")
    ran = knotwork("plot", *shown, *options, "-o", out)
    assert (ran.code, ran.err) == (0, "")
    text = out.read_text(encoding="utf-8")
    other = {"deg/s": "rad/s", "rad/s": "deg/s"}[unit]
    assert f"[{unit}]" in text
    assert f"[{other}]" not in text


@pytest.fixture(scope="module")
def figure(paper_case: Plan) -> Figure:
    return plot_joints(paper_case)


@pytest.mark.parametrize("suffix", START)
def test_pictures_have_named_type_and_replace_others(
    suffix: str, figure: Figure, tmp_path: Path
) -> None:
    path = written(tmp_path / f"a{suffix}", "old")
    assert save_figure(figure, str(path)) == path
    assert path.read_bytes().startswith(START[suffix])
    mask = os.umask(0)
    os.umask(mask)
    assert path.stat().st_mode & 0o777 == 0o666 & ~mask
    again = save_figure(figure, tmp_path / f"b{suffix.upper()}")
    assert again.read_bytes() == path.read_bytes()
    assert {entry.name for entry in tmp_path.iterdir()} == {path.name, again.name}


@pytest.mark.parametrize("name", ["a.jpg", "a", "a.png.txt", ".png", "a.yaml"])
def test_other_suffixes_are_refused(name: str, figure: Figure, tmp_path: Path) -> None:
    (tmp_path / name).write_text("kept")
    with pytest.raises(InputError, match=r"give \.png, \.svg, \.pdf"):
        save_figure(figure, tmp_path / name)
    assert (tmp_path / name).read_text() == "kept"


JOINTS = [f"left_manipulator_shoulder_and_wrist_joint_{i}_of_seven" for i in range(7)]


def task(points: int) -> dict[str, Any]:
    """Seven joints with long names through many waypoints with long names."""
    rng = np.random.default_rng(3)
    gaps = rng.uniform(0.4, 1.5, points)
    times = np.cumsum(gaps) - gaps[0]
    size, rate, phase = rng.uniform(0.5, 2.2, 7), rng.uniform(0.1, 0.6, 7), rng.uniform(0, 6, 7)

    def values(amplitude: Any, angle: Any) -> dict[str, float]:
        return dict(zip(JOINTS, (amplitude * angle).tolist(), strict=True))

    return {
        "name": "seven_joints",
        "limits": {
            "velocity": dict.fromkeys(JOINTS, 0.75),
            "position": {name: [-2.15, 2.5] for name in JOINTS},
            "acceleration": dict.fromkeys(JOINTS, 60.0),
        },
        "waypoints": [
            {
                "name": f"weld seam {i // 9} point {i}",
                "time": float(t),
                "joints": values(size, np.sin(rate * t + phase)),
                "velocity": values(size * rate, np.cos(rate * t + phase)),
            }
            for i, t in enumerate(times)
        ],
    }


def clean(figure: Any) -> None:
    assert overlaps(figure) == []
    assert outside(figure) == []


@pytest.mark.parametrize("points", first_of(50, 300))
def test_seven_joints_and_many_waypoints(points: int) -> None:
    plan = kw.plan(task(points))
    figure = plot_joints(plan)
    clean(figure)
    names = waypoint_names(figure.axes[0])
    assert 10 <= len(names) <= points
    assert names[0].get_position()[0] == 0.0
    assert all(len(name.get_text()) <= 16 for name in names)
    broken = [finding for finding in plan.report.select(group="Joint limits") if not finding.ok]
    for axis, quantity in zip(figure.axes, QUANTITIES, strict=True):
        expected = sum(failure.quantity == quantity for failure in broken)
        assert len(lines(axis, "exceeded")) == expected
    assert lines(figure.axes[1], "exceeded")
    joints = [word for word in legend_words(figure) if word.startswith("left")]
    assert len(set(joints)) == 7
    assert all(len(word) <= 26 for word in joints)


@pytest.mark.parametrize(
    "name", mostly_exhaustive(SCENARIO_FILES, "planar2_closed_form", "paper_case_presets")
)
def test_shipped_scenarios(name: str) -> None:
    plan = kw.plan(name)
    clean(plot_joints(plan))
    if plan.joints.robot is not None:
        clean(plot_tool(plan))


@pytest.mark.parametrize("name", ["_joint", "$q_1$", "a_{", "tab\there", "two\nlines", "%s", "αβ"])
def test_names_are_only_names(name: str) -> None:
    """Names are drawn as they are: no mathematics, no hidden entries, no second line."""
    given = {
        "name": name.strip(),
        "waypoints": [
            {"name": name, "joints": {name: 0.0, "b": 1.0}},
            {"name": "end", "joints": {name: 1.0, "b": 0.0}, "after": 1},
        ],
    }
    figure = plot_joints(kw.plan(given), quantities=["position"])
    clean(figure)
    shown = name.replace("\t", "·").replace("\n", "·")
    assert shown in legend_words(figure)
    assert shown in [text.get_text() for text in waypoint_names(figure.axes[0])]
