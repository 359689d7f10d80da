"""`knotwork view` and `knotwork report` as a user runs them."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import pytest

ENVIRONMENT = {
    name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")
}


def run(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "knotwork", *arguments],
        capture_output=True,
        text=True,
        encoding="utf-8",
        cwd=folder,
        env=ENVIRONMENT,
        timeout=120,
        check=False,
    )


def test_a_stored_trajectory_is_shown_with_its_scenario_or_robot(tmp_path: Path) -> None:
    assert run("plan", "planar2_closed_form", "--out", "moved", folder=tmp_path).returncode == 0
    for option in (("-s", "planar2_closed_form"), ("--robot", "planar2")):
        ran = run("view", "moved", *option, "--html", "a.html", folder=tmp_path)
        assert (ran.returncode, ran.stdout.strip()) == (0, "wrote a.html"), ran.stderr
        (tmp_path / "a.html").unlink()
    for options, words in (
        ((), "--scenario"),
        (("--robot", "ur5"), "shoulder_pan_joint"),
        (("-s", "ur5_deburring"), "lacks joint"),
        (("-s", "planar2_closed_form", "--planner", "cubic"), "planned already"),
    ):
        ran = run("view", "moved", *options, "--html", "a.html", folder=tmp_path)
        assert ran.returncode == 2
        assert words in ran.stderr
        assert "Traceback" not in ran.stderr
        assert not (tmp_path / "a.html").exists()


def test_joints_alone_are_plots_only(tmp_path: Path) -> None:
    ran = run("view", "paper_case", "--no-open", folder=tmp_path)
    assert ran.returncode == 2
    assert "only plots" in ran.stderr


def test_a_port_in_use_is_said(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = str(other.getsockname()[1])
        ran = run("view", "planar2_closed_form", "--no-open", "--port", port, folder=tmp_path)
    assert ran.returncode == 2
    assert f"port {port} is in use" in ran.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent as a signal")
def test_it_serves_until_interrupted(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-u", "-m", "knotwork", "view", "planar2_closed_form"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=ENVIRONMENT,
    ) as process:
        assert process.stdout is not None
        address = process.stdout.readline().split(" at ")[1].split()[0]
        with urllib.request.urlopen(address, timeout=60) as answer:
            assert b"planar2_closed_form" in answer.read()
        with pytest.raises(urllib.error.HTTPError, match="404") as refused:
            urllib.request.urlopen(f"{address}etc/passwd", timeout=60)
        refused.value.close()
        process.send_signal(signal.SIGINT)
        out, said = process.communicate(timeout=60)
    assert process.returncode == 0
    assert out.strip() == "stopped"
    assert said.strip() == "no browser could be opened here; open the address in one"


def test_a_report_is_written_whether_the_check_passes_or_not(tmp_path: Path) -> None:
    ran = run("report", "planar2_closed_form", "--html", "good.html", folder=tmp_path)
    assert ran.returncode == 0, ran.stderr
    other = ("--planner", "trapezoidal")
    ran = run("report", "planar2_closed_form", *other, "--html", "bad.html", folder=tmp_path)
    assert ran.returncode == 1
    assert "What fails" in (tmp_path / "bad.html").read_text(encoding="utf-8")
    assert "What fails" not in (tmp_path / "good.html").read_text(encoding="utf-8")
