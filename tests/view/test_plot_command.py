"""`knotwork plot`: files, words and exit codes."""

from __future__ import annotations

from pathlib import Path

import pytest

from command_line import Command

PNG = b"\x89PNG"


def commands_of_the_figures(help_text: str) -> list[list[str]]:
    """The commands that the help gives for the paper's figures."""
    joined = help_text.replace("\\\n", " ")
    return [
        line.split("knotwork plot ")[1].split()
        for line in joined.splitlines()
        if "knotwork plot paper_case" in line
    ]


def test_the_papers_figures_come_out_of_the_commands_in_the_help(
    knotwork: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    commands = commands_of_the_figures(knotwork("plot", "--help").out)
    assert len(commands) == 4
    for arguments in commands:
        ran = knotwork("plot", *arguments)
        assert ran.code == 0, ran.err
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {f"figure{number}.png" for number in (12, 13, 14, 15)}


def test_a_scenario_is_drawn_to_a_file_named_after_it(
    knotwork: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = knotwork("plot", "paper_case")
    assert (ran.code, ran.err) == (0, "")
    assert ran.out == "wrote paper_case.png\n"
    assert (tmp_path / "paper_case.png").read_bytes().startswith(PNG)
    ran = knotwork("plot", "planar2_closed_form", "--tool")
    assert ran.out == "wrote planar2_closed_form_tool.png\n"
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    ("name", "options", "unit"),
    [
        ("ur5_deburring", ["--joints=elbow_joint"], "deg/s"),
        ("ur5_deburring", ["--joints=elbow_joint", "--radians"], "rad/s"),
        ("panda_pick_place", ["--joints=panda_joint2"], "rad/s"),
    ],
)
def test_angles_are_in_the_units_of_the_scenario(
    knotwork: Command, tmp_path: Path, name: str, options: list[str], unit: str
) -> None:
    out = tmp_path / "a.svg"
    ran = knotwork("plot", name, "--quantities", "velocity", *options, "-o", out)
    assert (ran.code, ran.err) == (0, "")
    text = out.read_text(encoding="utf-8")
    other = {"deg/s": "rad/s", "rad/s": "deg/s"}[unit]
    assert f"[{unit}]" in text
    assert f"[{other}]" not in text
