"""`knotwork check A --with B`: the place and time of insufficient clearance of two motions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from knotwork.cli.logs import stated_path
from knotwork.cli.parameters import FAILED, PASSED, Seconds, bundle_options
from knotwork.cli.sources import read_motions
from knotwork.cli.terminal import echo_json, echo_line
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.files.documents import resources

if TYPE_CHECKING:
    from knotwork.task.scenario import Scenario
    from knotwork.task.scenario.joint_space import JointSpace

_BOTH = "Report only the clearance to another robot's motion, with place and time."
_OPTIONS = (
    ("--delay", "delay", "TIME", Seconds(zero=True), "Delay of the motion of --with."),
    ("--in", "frame", "FRAME", str, "Frame of the base of the robot of --with."),
    ("--motion", "motion", "FILE", str, "Recorded motion of --with; by default it is planned."),
    ("--with", "other", "SCENARIO|PLAN", str, _BOTH),
)


def _other_robot(
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
        "in": frame,
        "delay": delay or 0.0,
    }


with_options = bundle_options(
    "other",
    _other_robot,
    [
        click.option(flag, key, metavar=metavar, type=kind, help=text)
        for flag, key, metavar, kind, text in _OPTIONS
    ],
)


def _check_one_cell(source: str, scenario: Scenario, space: JointSpace, other: str) -> None:
    """Refuse robots without a known relative placement, unless they are two arms of one URDF."""
    from knotwork.task.scenario import load_scenario
    from knotwork.task.scenario.joint_space import joint_space

    theirs = joint_space(load_scenario(other))
    if space.robot is None or theirs.robot is None:
        return  # reported by another error
    one_urdf = space.robot.urdf == theirs.robot.urdf
    if one_urdf and not set(space.joint_names) & set(theirs.joint_names):
        return
    why = "both motions are of the same joints" if one_urdf else "their URDFs are not the same"
    frames = ", ".join(dict.fromkeys([*scenario.frames, "base"]))
    raise InputError(
        f"--with {other}: its robot has no placement, and {why}; accepted: --in with a "
        f"frame of {source}, one of {frames}"
    )


def check_together(
    source: str, reference: str | None, other: Mapping[str, Any], *, as_json: bool
) -> int:
    """Print in one line how close two motions come, and give the exit code."""
    from knotwork.planning import clearance_between

    first = read_motions(source, reference)[0]
    if isinstance(first, JointTrajectory):
        raise InputError(f"give the scenario of {source} with --scenario")
    if other["in"] is None:
        _check_one_cell(source, first.scenario, first.space, other["scenario"])
        other = {**other, "in": "base"}
    nearest = clearance_between(first.trajectory, first.scenario, other, space=first.space)
    word, colour = ("clear:", "green") if nearest.ok else ("TOO NEAR:", "red")
    if as_json:
        echo_json(nearest.to_dict())
    else:
        echo_line(f"{word} {nearest.message}", word, fg=colour, bold=True)
    return PASSED if nearest.ok else FAILED
