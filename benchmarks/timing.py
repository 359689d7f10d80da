"""Least times beside Ruckig, TOPP-RA and the paper's knots, over hundreds of random tasks.

Each task has 3 to 12 waypoints, 2 to 7 joints, moves from millimetres to radians, uneven limits of
velocity, acceleration and jerk, and velocities at its inner waypoints of one of three kinds:

* random: of any direction, up to 30 % of the limit;
* smooth: in the direction of both neighbours, as a smooth curve would have;
* fast: towards the next but one, up to half the limit.

All contenders but TOPP-RA meet positions and velocities at the waypoints and keep all three limits:

* Ruckig, interval by interval, with no acceleration at the waypoints;
* the same with accelerations chosen by coordinate search, waypoint by waypoint and joint by joint;
* the modified Hermite spline with the paper's knots and Ruckig's durations, stretched by the least
  factor of a list with which it keeps the limits, if there is one;
* TOPP-RA on the C2 cubic spline through the waypoints: it keeps neither the given velocities nor
  the limits of jerk, and is shown as what a path alone allows.

Beside these: long motions of six joints, whose time to solve should grow with their length; eight
waypoints of a UR5 whose limits of torque are lowered until they bind; and the shipped scenarios
whose times are chosen, with Ruckig chained at the velocities that were chosen for them, and those
without tool paths whose times are given, which are freed here.

The peers are no dependencies of Knotwork:

    python -m venv peers
    peers/bin/pip install . ruckig toppra

The seed makes a run repeatable, but for the times that solving takes. With
`--save benchmarks/results` the results are saved there, and the site shows them;
with `--only shipped` as well, what else is saved is kept.
"""

from __future__ import annotations

import importlib
import time as clock
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.progress import track

import knotwork as kw
import results
from knotwork.arrays import FloatArray
from knotwork.curves.interpolation.modified_hermite_spline import ModifiedHermiteSpline
from knotwork.errors import InputError
from knotwork.files.documents import resources
from knotwork.joint_quantities import JointLimits
from knotwork.planning.timing import (
    Dynamics,
    TimedMotion,
    TimingProblem,
    solve,
    solving,
)
from knotwork.task.scenario import Scenario, load_scenario
from results import Table
from toppra_peer import toppra_duration

KINDS = ("random", "smooth", "fast")
STRETCHES = (1.0, 1.05, 1.1, 1.2, 1.3, 1.4, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.0, 10.0)
PARTS = (-0.6, -0.3, 0.0, 0.3, 0.6)
SIZES = (8, 20, 50, 100, 200, 400, 1000)
WHOLE = 100  # motions of up to so many waypoints are also solved at once
# Parts of the torque limits, and limits of acceleration [rad/s²].
TORQUES = ((1.0, np.inf), (0.6, 30.0), (0.4, 15.0))
UR5_MIDDLE = np.array([0.0, -1.2, 1.2, -1.5, -1.5, 0.0])
CONTENDERS = {
    "knotwork": "Knotwork",
    "searched": "Ruckig, accelerations searched",
    "paper": "paper's knots, stretched",
    "toppra": "TOPP-RA, velocity and acceleration only",
}


def tasks(count: int, seed: int) -> Iterator[tuple[str, TimingProblem]]:
    """Random tasks, the kinds by turns."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        kind = KINDS[k % 3]
        n, d = int(rng.integers(3, 13)), int(rng.integers(2, 8))
        size = 10.0 ** rng.uniform(-1.5, 0.3, (n, 1))
        y = np.cumsum(rng.uniform(-1.0, 1.0, (n, d)) * size, axis=0)
        V, A = rng.uniform(1.0, 4.0, d), rng.uniform(3.0, 20.0, d)
        J = A * rng.uniform(5.0, 100.0, d)
        v, step = np.zeros((n, d)), np.diff(y, axis=0)
        if kind == "random":
            v[1:-1] = rng.uniform(-0.3, 0.3, (n - 2, d)) * V
        elif kind == "smooth":
            least = np.minimum(np.abs(step[1:]), np.abs(step[:-1]))
            along = np.clip(0.5 * np.sign(y[2:] - y[:-2]) * least, -0.8 * V, 0.8 * V)
            v[1:-1] = np.where(step[1:] * step[:-1] > 0.0, along, 0.0)
        else:
            v[1:-1] = np.clip(y[2:] - y[:-2], -0.5 * V, 0.5 * V)
        names = tuple(f"joint {i}" for i in range(d))
        yield kind, TimingProblem(names, y, v, JointLimits(V, A, J))


def ruckig_duration(problem: TimingProblem, i: int, a: FloatArray) -> float:
    """Ruckig's duration of an interval, the accelerations at its ends given; infinite if none."""
    ruckig: Any = importlib.import_module("ruckig")
    d = len(problem.joint_names)
    generator, given, found = ruckig.Ruckig(d), ruckig.InputParameter(d), ruckig.Trajectory(d)
    for end, k in (("current", i), ("target", i + 1)):
        setattr(given, f"{end}_position", problem.position[k].tolist())
        setattr(given, f"{end}_velocity", problem.velocity[k].tolist())
        setattr(given, f"{end}_acceleration", a[k].tolist())
    for name in ("velocity", "acceleration", "jerk"):
        setattr(given, f"max_{name}", getattr(problem.limits, name).tolist())
    try:
        done = generator.calculate(given, found)
    except RuntimeError:
        return np.inf
    fine = done in (ruckig.Result.Working, ruckig.Result.Finished)
    return float(found.duration) if fine else np.inf


def chained(problem: TimingProblem) -> FloatArray:
    """Ruckig's durations with no acceleration at the waypoints."""
    a = np.zeros_like(problem.position)
    return np.array([ruckig_duration(problem, i, a) for i in range(len(a) - 1)])


def searched(problem: TimingProblem, durations: FloatArray) -> float:
    """Total of Ruckig's durations, each acceleration at an inner waypoint the best of a few."""
    a, h = np.zeros_like(problem.position), durations.copy()
    for _ in range(2):
        for i in range(1, len(a) - 1):
            for k, most in enumerate(problem.limits.acceleration):
                for part in PARTS:
                    tried = a.copy()
                    tried[i, k] = part * most
                    new = [ruckig_duration(problem, j, tried) for j in (i - 1, i)]
                    if sum(new) < h[i - 1] + h[i]:
                        a, h[i - 1], h[i] = tried, *new
    return float(h.sum())


def paper(problem: TimingProblem, durations: FloatArray) -> float:
    """Total duration of the modified Hermite spline, stretched until it keeps the limits."""
    for stretch in STRETCHES:
        x = np.concatenate(([0.0], np.cumsum(stretch * durations)))
        try:
            curve = ModifiedHermiteSpline(x, problem.position, problem.velocity)
        except InputError:
            continue
        peaks = [curve.extrema(order).peak for order in (1, 2, 3)]
        limits = problem.limits
        most = (limits.velocity, limits.acceleration, limits.jerk)
        if all((peak <= limit).all() for peak, limit in zip(peaks, most, strict=True)):
            return float(x[-1])
    return np.inf


def row(kind: str, problem: TimingProblem) -> dict[str, Any]:
    """Durations of all contenders relative to chained Ruckig, and what ours took."""
    durations = chained(problem)
    reference = float(durations.sum())
    begun = clock.process_time()
    try:
        motion = solve(problem)
        ours, bound = motion.duration, motion.lower_bound
    except InputError:
        ours, bound = np.inf, 0.0
    seconds = clock.process_time() - begun
    found = {
        "knotwork": ours,
        "searched": searched(problem, durations),
        "paper": paper(problem, durations),
        "toppra": toppra_duration(
            np.linspace(0.0, 1.0, len(problem.position)),
            problem.position,
            problem.limits.velocity,
            problem.limits.acceleration,
            ends="clamped",
        ),
    }
    ratios = {k: round(v / reference, 5) if np.isfinite(v) else None for k, v in found.items()}
    return {
        "kind": kind,
        "waypoints": len(problem.position),
        "joints": len(problem.joint_names),
        "ruckig": round(reference, 6),
        **ratios,
        "bound": round(bound / reference, 5),
        "seconds": round(seconds, 4),
    }


def random_motion(rng: np.random.Generator, n: int) -> TimingProblem:
    """Waypoints of six joints, passed at velocities of any direction."""
    size = 10.0 ** rng.uniform(-1.5, 0.3, (n, 1))
    y = np.cumsum(rng.uniform(-1.0, 1.0, (n, 6)) * size, axis=0)
    V, A = rng.uniform(1.0, 4.0, 6), rng.uniform(3.0, 20.0, 6)
    v = np.zeros((n, 6))
    v[1:-1] = rng.uniform(-0.3, 0.3, (n - 2, 6)) * V
    names = tuple(f"joint {i}" for i in range(6))
    return TimingProblem(names, y, v, JointLimits(V, A, A * rng.uniform(5.0, 100.0, 6)))


def solved_in(problem: TimingProblem) -> tuple[TimedMotion, float]:
    """The motion, and what it took [s of CPU]."""
    begun = clock.process_time()
    motion = solve(problem)
    return motion, clock.process_time() - begun


def sizes(seed: int) -> list[dict[str, Any]]:
    """CPU time over the number of waypoints; and what windows lose, where that can be told."""
    rows = []
    for n in SIZES:
        problem = random_motion(np.random.default_rng([seed, n]), n)
        motion, seconds = solved_in(problem)
        loss = None
        if solving.MAX_INTERVALS < n <= WHOLE:
            longest, solving.MAX_INTERVALS = solving.MAX_INTERVALS, n
            loss = round(motion.duration / solve(problem).duration - 1.0, 6)
            solving.MAX_INTERVALS = longest
        rows.append({"waypoints": n, "seconds": round(seconds, 3), "loss": loss})
    return rows


def torques(seed: int) -> list[dict[str, Any]]:
    """Eight waypoints of a UR5 under limits of torque, and what these take."""
    robot, rows = kw.load_robot("ur5"), []
    dynamics = Dynamics(robot)
    effort = robot.model.effortLimit
    for k in range(9):
        rng = np.random.default_rng([seed, k])
        part, acceleration = TORQUES[k % 3]
        q = np.cumsum(rng.uniform(-0.6, 0.6, (8, 6)), axis=0) + UR5_MIDDLE
        v = np.zeros((8, 6))
        v[1:-1] = rng.uniform(-0.3, 0.3, (6, 6))
        A, J, V = np.full(6, acceleration), np.full(6, 400.0), robot.limits.velocity
        names = tuple(robot.joint_names)
        limits = JointLimits(V, A, J, effort=part * effort)
        motion, seconds = solved_in(TimingProblem(names, q, v, limits, dynamics=dynamics))
        free = solve(TimingProblem(names, q, v, JointLimits(V, A, J)))
        binds = sum(one.share or 0.0 for one in motion.active_limits if one.quantity == "effort")
        rows.append(
            {
                "torque": part,
                "acceleration": None if np.isinf(acceleration) else acceleration,
                "seconds": round(seconds, 3),
                "longer": round(motion.duration / free.duration - 1.0, 5),
                "binds": round(binds / 7, 3),
            }
        )
    return rows


def freed(scenario: Scenario) -> dict[str, Any]:
    """A scenario with given times as a mapping in which they are chosen.

    Where a joint has no limits to be fast under, the peaks of the motion with given times are all.
    """
    given = kw.plan(scenario)
    data = scenario.task.to_dict()
    data.pop("knots", None)
    for waypoint in data["waypoints"]:
        waypoint.pop("time", None)
        waypoint.pop("after", None)
    data["times"] = "fastest"
    limits = given.joints.limits
    if given.joints.robot is None or not np.isfinite(limits["effort"] + limits["velocity"]).all():
        angle = np.pi / 180.0 if (data.get("units") or {}).get("angle") == "deg" else 1.0
        names = given.joints.joint_names
        data["limits"] = {
            what: {
                name: float(1.001 * peak / angle)
                for name, peak in zip(names, given.trajectory.extrema(what).peak, strict=True)
            }
            for what in ("velocity", "acceleration", "jerk")
        }
    return data


def shipped() -> list[dict[str, Any]]:
    """The shipped scenarios with chosen times, and those whose given times can be chosen."""
    rows = []
    for name in resources.names("scenarios"):
        scenario = load_scenario(name)
        if scenario.unknowns is not None:
            rows.append(shipped_row(name, scenario, None))
        elif scenario.planner == "modified-hermite" and not scenario.paths:
            rows.append(shipped_row(name, load_scenario(freed(scenario)), np.ptp(scenario.times)))
    return rows


def shipped_row(name: str, scenario: Scenario, given: float | None) -> dict[str, Any]:
    """The minimum time of a scenario, next to Ruckig and the duration that it gives."""
    begun = clock.process_time()
    made = kw.plan(scenario)
    seconds = clock.process_time() - begun
    chosen_values, limits = made.chosen_values, made.joints.limits
    assert chosen_values is not None
    jerk = np.array(limits["jerk"])
    for k, joint in enumerate(made.joints.joint_names):
        jerk[k] = chosen_values.assumed_jerk.get(joint, jerk[k])
    ruckig, ours = 0.0, 0.0
    for run in chosen_values.sections:
        q = run.trajectory.position(run.time)
        bound = JointLimits(limits["velocity"], limits["acceleration"], jerk)
        ruckig += chained(TimingProblem(run.trajectory.joint_names, q, run.velocity, bound)).sum()
        ours += run.duration
    fair = np.isfinite(limits["acceleration"]).all() and np.isfinite(ruckig)
    return {
        "scenario": name,
        "given": None if given is None else round(float(given), 4),
        "duration": round(chosen_values.duration, 4),
        "gap": round(chosen_values.optimality_gap, 5),
        "ruckig": round(ours / ruckig, 5) if fair else None,
        "seconds": round(seconds, 3),
        "passes": made.report.ok,
    }


def tables(data: dict[str, Any]) -> list[Table]:
    """What the page and the terminal show."""
    found = [table(data["rows"])]
    lines = [
        [str(one["waypoints"]), f"{one['seconds']:.2f}", percent(one["loss"])]
        for one in data["sizes"]
    ]
    note = "Six joints; more than 24 intervals are solved in windows."
    columns: tuple[str, ...] = ("waypoints", "CPU s", "longer than solved at once")
    found.append(Table("Long motions.", columns, lines, note))
    lines = [
        [
            f"{100 * one['torque']:.0f} %",
            "none" if one["acceleration"] is None else f"{one['acceleration']:g}",
            f"{100 * one['binds']:.0f} %",
            percent(one["longer"]),
            f"{one['seconds']:.2f}",
        ]
        for one in data["torques"]
    ]
    columns = ("torque", "acceleration rad/s²", "at a torque limit", "longer for it", "CPU s")
    found.append(Table("Limits of torque.", columns, lines, "UR5, eight waypoints.", labels=2))
    lines = [
        [
            one["scenario"],
            "–" if one["given"] is None else f"{one['given']:.3f}",
            f"{one['duration']:.3f}",
            percent(one["gap"]),
            "–" if one["ruckig"] is None else f"{one['ruckig']:.3f}",
            f"{one['seconds']:.2f}",
            "yes" if one["passes"] else "no",
        ]
        for one in data["shipped"]
    ]
    columns = (
        "scenario",
        "given s",
        "minimum s",
        "above the bound",
        "to Ruckig",
        "CPU s to plan",
        "passes",
    )
    note = "Ruckig chained at the velocities chosen, in the stretches that are free."
    found.append(Table("Shipped scenarios.", columns, lines, note))
    return found


def percent(part: float | None) -> str:
    """A part of one as text."""
    return "–" if part is None else f"{100 * part:.2f} %"


def table(rows: list[dict[str, Any]]) -> Table:
    """Durations relative to chained Ruckig: median, worst, and how many were solved."""
    lines = []
    for key, name in CONTENDERS.items():
        for kind in ("all", *KINDS):
            here = [one for one in rows if kind in ("all", one["kind"])]
            done = np.array([one[key] for one in here if one[key] is not None])
            figures = [f"{f(done):.3f}" if done.size else "–" for f in (np.median, np.max)]
            lines.append([name, kind, *figures, f"{done.size} of {len(here)}"])
    seconds = np.array([one["seconds"] for one in rows])
    note = f"CPU time of ours: median {np.median(seconds):.2f} s, worst {seconds.max():.2f} s."
    columns = ("contender", "velocities", "median", "worst", "solved")
    return Table("Duration relative to chained Ruckig.", columns, lines, note, labels=2)


MEASURES: dict[str, Callable[[int], list[dict[str, Any]]]] = {
    "sizes": sizes,
    "torques": torques,
    "shipped": lambda seed: shipped(),
}


@click.command(help=__doc__.split("\n", maxsplit=1)[0])
@click.option("--tasks", "count", default=300, help="How many tasks.")
@click.option("--seed", default=14, help="Seed of the tasks.")
@click.option("--only", type=click.Choice(list(MEASURES)), help="Measure this part alone.")
@results.save_option
def main(count: int, seed: int, only: str | None, save: Path | None) -> None:
    """Run all tasks and show the tables."""
    console = Console()
    solve(random_motion(np.random.default_rng(seed), 4))  # what is loaded first is not counted
    data: dict[str, Any] = (
        {"seed": seed, "tasks": count} if only is None else results.load("timing")
    )
    for part, measured in MEASURES.items():
        if only in (None, part):
            data[part] = measured(seed)
    if only is None:
        data["rows"] = [row(*task) for task in track(list(tasks(count, seed)), console=console)]
    for one in tables(data):
        one.show(console)
    if save is not None:
        print(results.save(save, "timing", data))


if __name__ == "__main__":
    main()
