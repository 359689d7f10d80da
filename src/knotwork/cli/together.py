"""`knotwork check A --with B`: where and when two motions come too near."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from knotwork.cli.logs import stated_path
from knotwork.cli.parameters import FAILED, PASSED, Seconds, bundled
from knotwork.cli.sources import read_motions
from knotwork.cli.terminal import echo_data, echo_line
from knotwork.documents import resources
from knotwork.errors import InputError
from knotwork.trajectory import JointTrajectory

_BOTH = "Say only where and when it comes too near to another robot's motion, or that it is clear."
_OPTIONS = (
    ("--delay", "delay", "TIME", Seconds(), "How much later the motion of --with begins."),
    ("--in", "frame", "FRAME", str, "Frame that the base of the robot of --with stands in."),
    ("--motion", "motion", "FILE", str, "Recorded motion of --with; else it is planned."),
    ("--with", "other", "SCENARIO|PLAN", str, _BOTH),
)


def _other(
    other: str | None, motion: str | None, frame: str | None, delay: float | None
) -> dict[str, Any] | None:
    if other is None:
        if (motion, frame, delay) != (None, None, None):
            raise click.UsageError("--motion, --in and --delay are about the motion of --with")
        return None
    if Path(other).is_dir():
        motion, folder = motion or other, other
        other = stated_path(Path(folder)) or ""
        if not other:
            raise InputError(f"{folder} names no scenario; accepted: --with SCENARIO --motion FILE")
    if motion is not None:
        path = Path(motion).absolute()
        motion = str(path / "trajectory.json" if path.is_dir() else path)
    return {
        "scenario": str(resources.find("scenarios", other).absolute()),
        "motion": motion,
        "in": frame or "base",
        "delay": delay or 0.0,
    }


with_options = bundled(
    "other",
    _other,
    [
        click.option(flag, key, metavar=metavar, type=kind, help=text)
        for flag, key, metavar, kind, text in _OPTIONS
    ],
)


def check_together(
    source: str, reference: str | None, other: Mapping[str, Any], *, as_json: bool
) -> int:
    """Print in one line how near two motions come; gives the exit code."""
    from knotwork.pipeline import clearance_between

    first = read_motions(source, reference)[0]
    if isinstance(first, JointTrajectory):
        raise InputError(f"give the scenario that {source} is for with --scenario")
    found = clearance_between(first.trajectory, first.scenario, other, space=first.space)
    word, colour = ("clear:", "green") if found.ok else ("TOO NEAR:", "red")
    if as_json:
        echo_data(json.dumps(found.to_dict(), indent=1, allow_nan=False) + "\n")
    else:
        echo_line(f"{word} {found.message}", word, fg=colour, bold=True)
    return PASSED if found.ok else FAILED
