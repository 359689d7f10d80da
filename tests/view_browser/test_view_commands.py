"""`knotwork view` and `knotwork report` as a user runs them."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def run(knotwork: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The command in this process and an empty folder, without a display."""
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    return knotwork


def test_a_stored_trajectory_is_shown_with_its_scenario_or_robot(run: Any, tmp_path: Path) -> None:
    assert run("plan", "planar2_closed_form", "--out", "moved").code == 0
    for option in (("-s", "planar2_closed_form"), ("--robot", "planar2")):
        ran = run("view", "moved", *option, "--html", "a.html")
        assert (ran.code, ran.out.strip()) == (0, "wrote a.html"), ran.err
        text = (tmp_path / "a.html").read_text(encoding="utf-8")
        for said in (ran.err, text):
            assert ("does not name its tool" in said) == (option[0] == "--robot")
        (tmp_path / "a.html").unlink()
    for options, words in (
        ((), "--scenario"),
        (("--robot", "ur5"), "shoulder_pan_joint"),
        (("-s", "ur5_deburring"), "lacks joint"),
        (("-s", "planar2_closed_form", "--planner", "cubic"), "planned already"),
    ):
        ran = run("view", "moved", *options, "--html", "a.html")
        assert ran.code == 2
        assert words in ran.err
        assert "Traceback" not in ran.err
        assert not (tmp_path / "a.html").exists()


def test_joints_alone_are_plots_only(run: Any, tmp_path: Path) -> None:
    ran = run("view", "paper_case", "--no-open")
    assert ran.code == 2
    assert "only plots" in ran.err
    ran = run("report", "paper_case", "--html", "new/report.html")
    assert ran.code == 0
    assert "names no robot" in ran.err
    assert (tmp_path / "new" / "report.html").is_file()


@pytest.mark.parametrize("command", ["view", "report"])
def test_a_page_that_can_not_be_written_is_said_first(
    command: str, run: Any, tmp_path: Path
) -> None:
    ran = run(command, "no_such_scenario", "--html", "page.pdf")
    assert ran.code == 2
    assert "give .html, .htm" in ran.err
    assert not list(tmp_path.iterdir())


def test_a_port_in_use_is_said(run: Any) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = str(other.getsockname()[1])
        ran = run("view", "planar2_closed_form", "--no-open", "--port", port)
    assert ran.code == 2
    assert f"port {port} is in use" in ran.err
