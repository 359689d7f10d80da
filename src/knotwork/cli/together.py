"""`knotwork check A --with B`: where and when two motions come too near."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import click

from knotwork.cli.logs import stated_path
from knotwork.cli.parameters import FAILED, PASSED, GivenPath, Seconds, bundled
from knotwork.cli.sources import read_motions
from knotwork.cli.terminal import echo_line
from knotwork.errors import InputError
from knotwork.trajectory import JointTrajectory


@dataclass(frozen=True)
class Other:
    """The motion that another is checked against.

    Attributes:
        source: A scenario, or the folder of a saved plan.
        motion: Its recorded motion, or `None`.
        frame: Frame that its base stands in, or `None`.
        delay: How much later it begins [s].
    """

    source: str
    motion: Path | None
    frame: str | None
    delay: float


def _other(
    other: str | None, motion: Path | None, frame: str | None, delay: float | None
) -> Other | None:
    if other is not None:
        return Other(other, motion, frame, delay or 0.0)
    for option, value in (("--motion", motion), ("--in", frame), ("--delay", delay)):
        if value is not None:
            raise click.UsageError(f"{option} is about the motion that --with names")
    return None


with_options = bundled(
    "other",
    _other,
    (
        click.option(
            "--delay",
            metavar="TIME",
            type=Seconds(),
            help="With --with: how much later the other motion begins.",
        ),
        click.option(
            "--in",
            "frame",
            metavar="FRAME",
            help="With --with: the frame of the first scenario, or base, that the other robot's "
            "base stands in; left out: both are arms of one URDF.",
        ),
        click.option(
            "--motion",
            metavar="FILE",
            type=GivenPath(path_type=Path),
            help="With --with: the other's recorded motion; left out: its scenario is planned.",
        ),
        click.option(
            "--with",
            "other",
            metavar="SCENARIO|PLAN",
            help="Say only where and when the motion comes too near to that of another robot, or "
            "that both are clear. The first may then be a scenario, which is planned.",
        ),
    ),
)


def check_together(source: str, reference: str | None, other: Other, *, as_json: bool) -> int:
    """Print in one line how near two motions come; gives the exit code."""
    from knotwork.verification.together import clearance_between

    first = read_motions(source, reference)[0]
    if isinstance(first, JointTrajectory):
        raise InputError(f"give the scenario that {source} is for with --scenario")
    scenario, motion = other.source, other.motion
    if Path(scenario).is_dir():
        stated = stated_path(Path(scenario))
        if stated is None:
            raise InputError(
                f"{scenario} does not say what scenario it is a plan of; accepted: --with "
                "SCENARIO --motion FILE"
            )
        scenario, motion = stated, motion or Path(scenario)
    found = clearance_between(
        first.trajectory,
        first.scenario,
        scenario,
        motion=motion,
        frame=other.frame,
        delay=other.delay,
        space=first.space,
    )
    if as_json:
        click.echo(json.dumps(found.to_dict(), indent=1, allow_nan=False))
    elif found.ok:
        echo_line(f"clear: {found.message}", "clear:", fg="green", bold=True)
    else:
        echo_line(f"TOO NEAR: {found.message}", "TOO NEAR:", fg="red", bold=True)
    return PASSED if found.ok else FAILED
