"""What several test files share: command line and browser in this process, plans made once."""

from __future__ import annotations

import gc
import os
import signal
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from browser import barriers, chromium
from command_line import Command, Ran
from knotwork import Plan
from knotwork.cli.main import main
from plans import planned
from sweeps import ALL_EXAMPLES

# What the terminal is like, and where packages are, each test says itself.
for name in (
    *("COLUMNS", "LINES", "TERM", "FORCE_COLOR", "NO_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"),
    *("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "KNOTWORK_TRACEBACK"),
):
    os.environ.pop(name, None)

# In the background of a shell interrupts are ignored, by what the tests start there, too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# How long an example takes depends on the machine, and on what else it does. Where a verdict is
# waited for, it is on the same examples each time.
settings.register_profile(
    "ordinary",
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    derandomize="CI" in os.environ,
)
settings.load_profile("ordinary")
settings.register_profile(ALL_EXAMPLES)


@pytest.fixture
def knotwork(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    """The `knotwork` command, run in this process; on a slow machine, too, it says no more."""
    monkeypatch.setattr("knotwork.cli.progress_display.PLAN_INTERVAL", 1e6)

    def run(*arguments: object) -> Ran:
        monkeypatch.setattr(sys, "argv", ["knotwork", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as stopped:
            main()
        captured = capsys.readouterr()
        return Ran(stopped.value.code, captured.out, captured.err)

    return run


@pytest.fixture
def run(knotwork: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """The command in this process and an empty folder, without a display."""
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    return knotwork


@pytest.fixture
def without_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports have no plots, which take most of their time, where only words are read."""
    from matplotlib.figure import Figure

    for name in ("joints", "tool"):
        monkeypatch.setattr(f"knotwork.view.html_report.plot_{name}", lambda _: Figure())


@pytest.fixture(scope="session")
def deburring() -> Plan:
    """The plan of the main scenario, made once."""
    return planned("ur5_deburring")


@pytest.fixture(scope="session")
def deburring_by_waypoints() -> Plan:
    """The same task, its edge given by seven waypoints instead of a path."""
    return planned(Path(__file__).parent / "scenario" / "by_waypoints" / "ur5_deburring.yaml")


@pytest.fixture(scope="session")
def paper_case() -> Plan:
    """The plan of the paper's case, made once."""
    return planned("paper_case")


def pytest_sessionstart() -> None:
    gc.disable()


def pytest_collection_finish() -> None:
    """What modules define lives as long as the tests: looking for garbage in it takes seconds."""
    gc.freeze()
    gc.enable()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """How many wrong motions the judge has made, by fault, and how many passed the check."""
    counts: dict[str, list[int]] = {}
    for report in (one for reports in terminalreporter.stats.values() for one in reports):
        for name, value in getattr(report, "user_properties", ()):
            if name.startswith("wrong motions: ") and report.when == "call":
                fault = name.partition(": ")[2]
                so_far = counts.get(fault, [0, 0])
                counts[fault] = [a + b for a, b in zip(so_far, value, strict=True)]
    if counts:
        count, passed = (sum(column) for column in zip(*counts.values(), strict=True))
        terminalreporter.section(f"{count} wrong motions, {passed} passed")
        for name, (of_it, through) in counts.items():
            terminalreporter.write_line(f"{of_it:6} {name}, {through} passed")


__all__ = ["barriers", "chromium", "deburring", "deburring_by_waypoints", "knotwork", "paper_case"]
