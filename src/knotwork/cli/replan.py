"""`knotwork replan`: another task, from a time of a running motion."""

from __future__ import annotations

from pathlib import Path

import click

from knotwork import planning
from knotwork.cli.logs import read_stated_scenario
from knotwork.cli.parameters import (
    FAILED,
    PASSED,
    NonEmptyPath,
    Seconds,
    budget_option,
    exit_codes,
    folder_option,
    full_option,
    json_option,
    package_path_option,
)
from knotwork.cli.plan import plan_to_dict, print_plan
from knotwork.cli.progress_display import show_planning
from knotwork.cli.sources import print_failures, read_unchecked
from knotwork.cli.terminal import echo_json
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import DocumentError, InputError
from knotwork.files.documents import Document
from knotwork.files.foreign import is_foreign, is_trajectory
from knotwork.robot import load_robot
from knotwork.task import Task
from knotwork.task.scenario import Scenario, load_scenario


@click.command(epilog=exit_codes())
@click.argument("source", metavar="PLAN", type=NonEmptyPath())
@click.argument("task", metavar="SCENARIO")
@click.option(
    "--at",
    type=Seconds(zero=True),
    required=True,
    metavar="TIME",
    help="Time in the running motion, for example 3.2 or 3.2s.",
)
@folder_option("Write trajectory.json, samples.csv, scenario.yaml and report.json there.")
@package_path_option
@full_option
@budget_option
@json_option
def replan(
    source: str,
    task: str,
    at: float,
    out: Path | None,
    full: bool,
    budget: float | None,
    as_json: bool,
) -> int:
    """Plan SCENARIO from the state of a running motion, without a jump of acceleration.

    PLAN is a folder written by `knotwork plan -o`, a trajectory of any tool that `knotwork check`
    reads, or a scenario, which is planned. Its state at the given time replaces SCENARIO's
    start, or its first waypoint if there are several and no start. Times in SCENARIO count from
    the given time.
    """
    new_task = Task.load(task)
    if is_trajectory(source):
        motion, current = _read_motion(source, new_task)
    else:
        with show_planning(source, as_json) as progress:
            running = planning.plan(source, budget=budget, progress=progress)
        print_failures([running])
        motion, current = running.trajectory, running.scenario
    try:
        scenario = planning.continued_scenario(motion, at, new_task, current)
        with show_planning(task, as_json) as progress:
            plan = planning.plan(scenario, budget=budget, progress=progress)
    except DocumentError as error:
        if error.file is not None:
            raise
        raise DocumentError(task, error.problems) from error
    written = plan.save(out) if out is not None else []
    code = PASSED if plan.report.ok else FAILED
    if as_json:
        plans = [plan_to_dict(task, plan, written)]
        echo_json({"ok": code == PASSED, "plans": plans})
    else:
        print_plan(plan, written, full)
    return code


def _read_motion(source: str, new_task: Task) -> tuple[JointTrajectory, Scenario | None]:
    """The running motion in a file or folder, and its scenario if known."""
    robot, described = None, new_task.robot
    if is_foreign(source):
        if described is None:
            raise InputError(f"{source} needs a robot, but the scenario names none")
        robot = load_robot(Document(described) if isinstance(described, dict) else described)
    motion, reference = read_unchecked(source, robot), read_stated_scenario(source)
    return motion, None if reference is None else load_scenario(reference)
