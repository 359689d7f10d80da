"""How long `knotwork plan` takes from a cold start, beside the bare imports it can't do without.

Each command is a process of its own; they take turns, so that a noisy machine disturbs all of them
alike. The ratio to the bare import of Pinocchio is what to look at.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stdout
from importlib import import_module
from io import StringIO
from typing import TYPE_CHECKING, TypeVar

import click
from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:  # its import is measured
    from knotwork import Report

Result = TypeVar("Result")

# What reads YAML, checks a schema, knows the robot, parses the command line and prints tables.
NEEDED = """
import click, pinocchio, pydantic, rich.console, rich.table, yaml
class Model(pydantic.BaseModel): pass
"""
COMMANDS = {
    "python -c pass": ["-c", "pass"],
    "import numpy": ["-c", "import numpy"],
    "import pinocchio": ["-c", "import pinocchio"],
    "import all a plan needs": ["-c", NEEDED],
    "import knotwork": ["-c", "import knotwork"],
    "knotwork --help": ["-m", "knotwork", "--help"],
    "knotwork plan SCENARIO": ["-m", "knotwork", "plan", "{scenario}"],
}
REFERENCE = "import pinocchio"
# Modules are compiled once, as users have them, and not anew in each run.
ENVIRONMENT = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}


def whole_commands(scenario: str, runs: int) -> dict[str, float]:
    """Median wall time of each command [s], the commands in turn."""
    times: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(runs + 1):  # the first run warms the disk cache and does not count
        for name, arguments in COMMANDS.items():
            line = [sys.executable, *(part.format(scenario=scenario) for part in arguments)]
            start = time.perf_counter()
            subprocess.run(line, env=ENVIRONMENT, check=True, stdout=subprocess.DEVNULL)
            times[name].append(time.perf_counter() - start)
    return {name: statistics.median(values[1:]) for name, values in times.items()}


def stages(scenario: str) -> list[tuple[str, float]]:
    """Time of each stage of a plan in one fresh process [s], imports included."""
    rows: list[tuple[str, float]] = []

    def timed(name: str, action: Callable[[], Result]) -> Result:
        start = time.perf_counter()
        result = action()
        rows.append((name, time.perf_counter() - start))
        return result

    def imported(*names: str) -> Callable[[], object]:
        return lambda: [import_module(name) for name in names]

    timed("import numpy", imported("numpy"))
    timed("import pinocchio", imported("pinocchio"))
    timed("import pydantic", imported("pydantic"))
    timed("import click, yaml", imported("click", "yaml"))
    timed(
        "import knotwork", imported("knotwork.planning.planning", "knotwork.planning.task_to_joint")
    )
    from knotwork.cli.short_report import print_short
    from knotwork.curves.interpolation import get_planner
    from knotwork.planning.planner_options import planner_options
    from knotwork.planning.task_to_joint import solve_task
    from knotwork.task.scenario import load_scenario
    from knotwork.task.scenario.scenario_joints import read_scenario_joints
    from knotwork.verification import check

    task = timed("read the scenario", lambda: load_scenario(scenario))
    joints = timed("load the robot", lambda: read_scenario_joints(task))
    waypoints = timed("inverse kinematics", lambda: solve_task(task, joints).waypoints)
    options = planner_options(task, joints)
    trajectory = timed("interpolate", lambda: get_planner(task.planner)(waypoints, options))
    report = timed("check", lambda: check(trajectory, task, joints=joints))
    timed("print", lambda: _printed(print_short, report))
    return rows


def _printed(show: Callable[[Report], None], report: Report) -> None:
    with redirect_stdout(StringIO()):
        show(report)


@click.command()
@click.option("--scenario", default="ur5_deburring", show_default=True)
@click.option("--runs", default=11, show_default=True, help="Counted runs of each command.")
@click.option("--stages-only", is_flag=True, hidden=True)
def main(scenario: str, runs: int, stages_only: bool) -> None:
    """Measure the cold start of `knotwork plan` and show where the time goes."""
    if stages_only:
        for stage, took in stages(scenario):
            print(f"{stage}\t{took}")
        return
    console = Console()
    medians = whole_commands(scenario, runs)
    table = Table(title=f"Whole processes, median of {runs}", title_justify="left")
    table.add_column("command")
    table.add_column("ms", justify="right")
    table.add_column(f"ratio to {REFERENCE!r}", justify="right")
    for name, seconds in medians.items():
        table.add_row(name, f"{1e3 * seconds:.0f}", f"{seconds / medians[REFERENCE]:.2f}")
    console.print(table)
    line = [sys.executable, __file__, "--stages-only", "--scenario", scenario]
    found: dict[str, list[float]] = {}
    for _ in range(runs):
        done = subprocess.run(line, env=ENVIRONMENT, check=True, capture_output=True, text=True)
        output = done.stdout
        for row in output.splitlines():
            label, text = row.split("\t")
            found.setdefault(label, []).append(float(text))
    table = Table(title=f"Where it goes, in order, median of {runs}", title_justify="left")
    table.add_column("stage")
    table.add_column("ms", justify="right")
    for name, values in found.items():
        table.add_row(name, f"{1e3 * statistics.median(values):.1f}")
    console.print(table)


if __name__ == "__main__":
    main()
