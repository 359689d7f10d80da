"""Every planner, and every knot option, over thousands of random joint tasks.

Three kinds of task, from kind to hostile:

* smooth: positions and velocities sampled from a smooth curve that the waypoints resolve;
* near: random positions, velocities near what the neighbours suggest;
* arbitrary: random positions, random velocities of the size of the mean velocities.

Each with times whose longest interval is exactly 1, 10 or 100 times the shortest. One joint, 3 to
50 waypoints, mean velocities of size 1, so that all figures compare. The seed makes a run
repeatable, but for the times that planning takes. With `--save benchmarks/results` the results are
saved there, and `make figures` renders docs/planners.md from them. With `--only PLANNER` as well,
that planner alone is measured, beside the two it is compared with, and takes its place among those
that are saved; if it is slow, on the first few tasks of each kind, which tables then say.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.progress import track

import results
from knotwork.curves.interpolation import BalancedKnots, PlannerOptions, get_planner
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.joint_quantities import JointLimits
from knotwork.planning.choosing.timing_sections import MAX_JERK
from knotwork.planning.timing import Objective, TimingProblem, solve
from knotwork.verification import metrics
from knotwork.waypoints import ChosenSection, JointWaypoints
from planner_tables import KINDS, RATIOS, rounded, tables

OPTIMAL = "modified-hermite, optimal"
CONTENDERS: dict[str, tuple[str, PlannerOptions]] = {
    "modified-hermite, paper": ("modified-hermite", PlannerOptions()),
    "modified-hermite, balanced 0.1": (
        "modified-hermite",
        PlannerOptions(knots=BalancedKnots(0.1)),
    ),
    "modified-hermite, balanced 0.2": ("modified-hermite", PlannerOptions(knots="balanced")),
    "modified-hermite, balanced 0.35": (
        "modified-hermite",
        PlannerOptions(knots=BalancedKnots(0.35)),
    ),
    OPTIMAL: ("optimal", PlannerOptions()),
    "cubic": ("cubic", PlannerOptions()),
    "quintic, zero": ("quintic", PlannerOptions()),
    "quintic, estimated": ("quintic", PlannerOptions(accelerations="estimated")),
    "septic, zero": ("septic", PlannerOptions()),
    "nonic, zero": ("nonic", PlannerOptions()),
    "3-5-3": ("3-5-3", PlannerOptions()),
    "4-3-4": ("4-3-4", PlannerOptions()),
    "bspline": ("bspline", PlannerOptions()),
    "bspline-velocity": ("bspline-velocity", PlannerOptions()),
    "parabolic-blend": ("parabolic-blend", PlannerOptions()),
    "trapezoidal": ("trapezoidal", PlannerOptions()),
}
NO_LIMIT = np.array([np.inf])
FIGURES: dict[str, Callable[[JointTrajectory, JointWaypoints], float]] = {
    "peak velocity": lambda t, w: metrics.peak(t, 1, NO_LIMIT).value,
    "peak accel.": lambda t, w: metrics.peak(t, 2, NO_LIMIT).value,
    "peak jerk": lambda t, w: metrics.peak(t, 3, NO_LIMIT).value,
    "∫ accel.²": lambda t, w: metrics.integral_of_square(t, 2),
    "∫ jerk²": lambda t, w: metrics.integral_of_square(t, 3),
    "fluctuation": lambda t, w: float(metrics.velocity_fluctuation(t, w)[0]),
    "accel. jump": lambda t, w: metrics.acceleration_jump(t),
    "velocity miss": metrics.velocity_miss,
    "position miss": metrics.position_miss,
}
# Shown as ratios: to the plain cubic, the least that meets positions and velocities; and, as its
# jerk has no bound, to the paper's curve.
RELATIVE = {
    "peak velocity": "cubic",
    "peak accel.": "cubic",
    "peak jerk": "modified-hermite, paper",
    "∫ accel.²": "cubic",
    "∫ jerk²": "modified-hermite, paper",
    "time to plan": "cubic",
}
REFERENCES = tuple(dict.fromkeys(RELATIVE.values()))
# The best of a few runs is what planning itself takes; long ones [s] are not repeated.
RUNS = 3
LONG = 0.01


def task(rng: np.random.Generator, kind: str, ratio: int) -> JointWaypoints:
    """Make a random task of one joint."""
    n = int(np.exp(rng.uniform(np.log(3), np.log(51))))
    h = np.exp(rng.uniform(0, np.log(ratio), n - 1))
    shortest, longest = rng.choice(n - 1, 2, replace=False)
    h[shortest], h[longest] = 1.0, ratio
    time = np.concatenate([[0], np.cumsum(h)])
    if kind == "smooth":
        period = 4 * h.max() * rng.uniform(1, 3, 3)
        size, phase = rng.normal(size=3), rng.uniform(0, 2 * np.pi, 3)
        turn = 2 * np.pi * time[:, None] / period + phase
        position = (size * period / (2 * np.pi) * np.sin(turn)).sum(axis=1)
        velocity = (size * np.cos(turn)).sum(axis=1)
    else:
        mean = rng.normal(size=n - 1)
        position = np.concatenate([[0], np.cumsum(mean * h)])
        velocity = rng.normal(size=n)
        if kind == "near":
            inner = (mean[:-1] * h[1:] + mean[1:] * h[:-1]) / (h[1:] + h[:-1])
            velocity = np.concatenate([[0], inner, [0]]) + 0.2 * velocity
        velocity[[0, -1]] = 0
    return JointWaypoints(("joint",), time, position[:, None], velocity[:, None])


Result = dict[str, dict[str, float]]
"""Figures of each contender that can do a task."""


def optimal(waypoints: JointWaypoints, options: PlannerOptions) -> JointTrajectory:
    """What `knots: optimal` plans where no limits are given: the least integral of jerk squared."""
    none = np.full(len(waypoints.joint_names), np.inf)
    problem = TimingProblem(
        waypoints.joint_names,
        waypoints.position,
        waypoints.velocity,
        JointLimits(none, none, np.full_like(none, MAX_JERK)),
        duration=np.diff(waypoints.time),
        objective=Objective(time=0.0, jerk=1.0),
    )
    found = solve(problem).trajectory
    times = found.breaks + waypoints.time[0]
    run = ChosenSection(times, found.acceleration(found.breaks))
    return get_planner("modified-hermite")(waypoints, PlannerOptions(chosen=(run,)))


def measure(waypoints: JointWaypoints, names: Iterable[str] = tuple(CONTENDERS)) -> Result:
    """Figures of each contender that can do the task."""
    found: dict[str, dict[str, float]] = {}
    for name in names:
        planner, options = CONTENDERS[name]
        plan, seconds = optimal if name == OPTIMAL else get_planner(planner), np.inf
        try:
            for _ in range(RUNS):
                start = clock.perf_counter()
                trajectory = plan(waypoints, options)
                seconds = min(seconds, clock.perf_counter() - start)
                if seconds > LONG:
                    break
        except InputError:
            continue
        found[name] = {figure: f(trajectory, waypoints) for figure, f in FIGURES.items()}
        found[name]["time to plan"] = seconds
    return {
        name: {
            f"{figure} / {RELATIVE[figure].split(', ')[-1]}" if figure in RELATIVE else figure: (
                value / found[RELATIVE[figure]][figure] if figure in RELATIVE else value
            )
            for figure, value in values.items()
        }
        for name, values in found.items()
    }


def row(kind: str, ratio: int, name: str, results: list[Result]) -> dict[str, Any]:
    """Median and worst of each figure of a contender; no jerk where the acceleration jumps."""
    done = [result[name] for result in results if name in result]
    jumps = max(values["accel. jump"] for values in done) > 1e-9
    figures: dict[str, list[float] | None] = {}
    for figure in done[0]:
        values = [found[figure] for found in done]
        shown = (float(np.median(values)), float(np.max(values)))
        unbounded = jumps and "jerk" in figure
        figures[figure] = None if unbounded else [rounded(value) for value in shown]
    share = round(100 * len(done) / len(results))
    return {"kind": kind, "ratio": ratio, "planner": name, "done": share, "figures": figures}


def put_in_place(rows: list[dict[str, Any]], only: str, tasks: int) -> dict[str, Any]:
    """The saved results with a planner's rows, and on how many of the tasks it was measured."""
    saved = results.load("planners")
    if tasks > saved["tasks"]:
        raise click.UsageError(f"--tasks {tasks}: {saved['tasks']} tasks of each kind are saved")
    order = list(CONTENDERS)
    merged = [row for row in saved["rows"] if row["planner"] != only] + rows
    merged.sort(key=lambda r: (KINDS.index(r["kind"]), r["ratio"], order.index(r["planner"])))
    return {"tasks": saved["tasks"], "first": {**saved["first"], only: tasks}, "rows": merged}


@click.command()
@click.option("--tasks", default=300, show_default=True, help="Tasks of each kind and ratio.")
@click.option("--seed", default=1, show_default=True)
@click.option("--only", type=click.Choice(list(CONTENDERS)), help="Measure this planner alone.")
@results.save_option
def main(tasks: int, seed: int, only: str | None, save: Path | None) -> None:
    """Compare planners over random tasks: median / worst of each figure."""
    names = tuple(CONTENDERS) if only is None else (*REFERENCES, only)
    rows = []
    for kind in KINDS:
        for ratio in RATIOS:
            rng = np.random.default_rng([seed, KINDS.index(kind), ratio])
            label = f"{kind} tasks, longest : shortest interval {ratio}"
            work = track(range(tasks), label, console=Console(stderr=True), transient=True)
            found = [measure(task(rng, kind, ratio), names) for _ in work]
            shown = CONTENDERS if only is None else (only,)
            done = [name for name in shown if any(name in result for result in found)]
            rows += [row(kind, ratio, name, found) for name in done]
    data: dict[str, Any] = {"tasks": tasks, "first": {}, "rows": rows}
    if only is not None:
        data = put_in_place(rows, only, tasks)
    for table in tables(data):
        table.show(Console(width=230))
    if save is not None:
        print(results.save(save, "planners", data))


if __name__ == "__main__":
    main()
