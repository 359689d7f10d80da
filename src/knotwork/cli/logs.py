"""Robot logs as input of the commands: options, reading and checking."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import click

from knotwork import planning
from knotwork.cli.parameters import NonEmptyPath, bundle_options, given_options
from knotwork.cli.terminal import print_note
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.files.foreign import is_foreign, read_trajectory
from knotwork.files.storage import load_trajectory
from knotwork.files.storage.report_digests import stated_scenario
from knotwork.task.scenario import load_scenario
from knotwork.task.scenario.scenario_joints import read_scenario_joints
from knotwork.verification.recording import (
    Alignment,
    LogTolerances,
    Smoothed,
    aligned,
    check_log,
    read_log,
    smoothed,
)
from knotwork.verification.report import CheckedMotion


@dataclass(frozen=True)
class LogOptions:
    """Options of a log on the command line.

    Attributes:
        against: Path of the plan to compare with, if given.
        noise: Standard deviation of the log's positions [rad or m]; by default it is estimated.
        unit: `"rad"` or `"deg"`: unit of revolute joints whose headings state none.
        topic: Topic to read, if several have all joints.
        tolerances: Tolerances of the log relative to its plan.
    """

    against: str | None = None
    noise: float | None = None
    unit: str = "rad"
    topic: str | None = None
    tolerances: LogTolerances | None = None


class Tolerance(click.ParamType[Any]):
    """A tolerance: `0.5mm`, `0.1deg`, `0.2s`, `joints=0.1deg`, `elbow_joint=1mrad`."""

    name = "tolerance"
    UNITS: ClassVar = {
        "m": ("m", 1.0), "mm": ("m", 1e-3), "s": ("s", 1.0), "ms": ("s", 1e-3),
        "rad": ("rad", 1.0), "mrad": ("rad", 1e-3), "deg": ("rad", math.pi / 180.0),
    }  # fmt: skip

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Read the argument as its subject, the SI unit and the size in it."""
        subject, _, number = str(value).rpartition("=")
        units = "|".join(self.UNITS)
        match = re.fullmatch(rf"(\d+\.?\d*|\.\d+)(e[+-]?\d+)? ?({units})", number)
        unit, factor = self.UNITS[match[3]] if match else ("", 0.0)
        size = factor * float(f"{match[1]}{match[2] or ''}") if match else 0.0
        if not 0.0 < size < math.inf or (subject and unit == "s"):
            self.fail(
                f"{value!r} is not accepted; give a positive number with its unit: mm, m, deg, rad "
                "or mrad for the tool, the same after joints= or the name of a joint, and s or ms "
                "for the delay of the log, such as 0.5mm, 0.1deg, joints=0.1deg or 0.2s",
                param,
                ctx,
            )
        return subject, unit, size


def _tolerances(sizes: Sequence[tuple[str, str, float]]) -> LogTolerances | None:
    """Tolerances of tool, joints and delay from the option's values."""
    tool, joints, delay = dict[str, float](), dict[str, float](), None
    for subject, unit, size in sizes:
        if unit == "s":
            delay = size
        elif subject in ("", "tool"):
            tool[unit] = size
        else:
            joints[unit if subject == "joints" else subject] = size
    return LogTolerances(tool, joints, delay) if sizes else None


def _log(
    is_log: bool,
    against: str | None,
    noise: float | None,
    log_unit: str | None,
    topic: str | None,
    tolerance: Sequence[tuple[str, str, float]],
) -> LogOptions | None:
    if is_log or against is not None:
        return LogOptions(against, noise, log_unit or "rad", topic, _tolerances(tolerance))
    of_logs = {"--noise": noise, "--log-unit": log_unit, "--topic": topic, "--tolerance": tolerance}
    if named := given_options(of_logs):
        raise InputError(f"{', '.join(named)} is for logs: add --log")
    return None


# Options for logs; the command gets them as `log`, or `None`.
log_options = bundle_options("log", _log, (
    click.option("--topic", metavar="NAME", help="For a log: topic to read, "
            "for example /joint_states, if several have all joints."),
    click.option("--log-unit", type=click.Choice(["rad", "deg"]),
            help="For a log: unit of revolute joints without one in their headings."),
    click.option("--tolerance", metavar="[JOINT=]SIZE", multiple=True, type=Tolerance(),
            help="For a log: tolerance relative to its plan: 0.5mm and 0.1deg of the tool, "
            "joints=0.1deg or elbow_joint=0.1deg of joints, 0.2s in time; may be repeated."),
    click.option("--noise", type=float, metavar="SIGMA",
            help="For a log: standard deviation of its positions [rad or m]; by default "
            "it is estimated from the samples."),
    click.option("--against", metavar="PLAN", type=NonEmptyPath(),
            help="TRAJECTORY is a log; compare it with this plan, a trajectory.json "
            "or its folder."),
    click.option("--log", "is_log", is_flag=True,
            help="TRAJECTORY is the log of a robot, CSV with noise: estimate the smooth "
            "motion behind it."),
))  # fmt: skip


def smoothed_log(
    path: str | Path, names: Sequence[str], units: Sequence[str], log: LogOptions
) -> Smoothed:
    """Read a log and estimate the smooth motion behind it.

    Raises:
        InputError: The log can't be read, or the noise is not a positive number.
    """
    recorded = read_log(path, names, units, topic=log.topic, degrees=log.unit == "deg")
    return smoothed(recorded, log.noise)


def checked_log(path: str | Path, reference: str, log: LogOptions) -> CheckedMotion:
    """Read a log, align it with the clock of a plan, and check it against its scenario.

    Args:
        path: The log.
        reference: Name or path of the scenario.
        log: Options of the log. If they name no plan, the scenario is planned.

    Raises:
        InputError: The log or the plan can't be read, or the scenario can't be planned.
    """
    scenario = load_scenario(reference)
    joints = read_scenario_joints(scenario)
    curve = smoothed_log(path, joints.joint_names, joints.joint_units, log)
    if log.against is not None:
        span = (float(scenario.times[0]), float(scenario.times[-1]))
        plan = read_trajectory(log.against, joints.joint_names, joints.joint_units, span=span)[0]
    else:
        plan = planning.plan(reference).trajectory
    alignment = aligned(curve, plan)
    report = check_log(alignment, scenario, joints, log.tolerances)
    return CheckedMotion(scenario, joints, None, alignment.trajectory, report)


def planned_scenario(source: str | Path, log: LogOptions | None) -> str | None:
    """The scenario that a report states: of a plan, or of the one that a log is compared with."""
    plan = source if log is None else log.against
    return None if plan is None else read_stated_scenario(plan)


def read_stated_scenario(plan: str | Path) -> str | None:
    """Name or path of the scenario that a plan's report states; a note is printed if it is lost."""
    scenario, note = stated_scenario(Path(plan))
    print_note(note)
    return scenario


def log_beside_plan(path: str | Path, log: LogOptions) -> tuple[Alignment, JointTrajectory]:
    """Read a log and its plan, which names the joints, and align the log with the plan's clock.

    Raises:
        InputError: No plan is given, the plan is another tool's, or a file can't be read.
    """
    if log.against is None or is_foreign(log.against):
        raise InputError(
            f"{path} needs its scenario: give --scenario, or with --against a "
            "plan written by `knotwork plan -o`"
        )
    plan = load_trajectory(log.against)
    return aligned(smoothed_log(path, plan.joint_names, plan.joint_units, log), plan), plan
