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

The peers are no dependencies of Knotwork:

    python -m venv peers
    peers/bin/pip install . ruckig toppra

The seed makes a run repeatable, but for the times that solving takes. With
`--save benchmarks/results` the results are saved there.
"""

from __future__ import annotations

import importlib
import time as clock
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.progress import track

import results
from knotwork.errors import InputError
from knotwork.interpolation.hermite import ModifiedHermiteSpline
from knotwork.timing import TimingLimits, TimingProblem, solve
from knotwork.waypoints import FloatArray
from results import Table

KINDS = ("random", "smooth", "fast")
STRETCHES = (1.0, 1.05, 1.1, 1.2, 1.3, 1.4, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.0, 10.0)
PARTS = (-0.6, -0.3, 0.0, 0.3, 0.6)
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
        yield kind, TimingProblem(names, y, v, TimingLimits(V, A, J))


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


def toppra_duration(problem: TimingProblem) -> float:
    """TOPP-RA on the cubic spline through the waypoints, at rest at both ends."""
    ta: Any = importlib.import_module("toppra")
    constraint: Any = importlib.import_module("toppra.constraint")
    algorithm: Any = importlib.import_module("toppra.algorithm")
    ta.setup_logging("ERROR")
    s = np.linspace(0.0, 1.0, len(problem.position))
    path = ta.SplineInterpolator(s, problem.position, bc_type="clamped")
    V, A = problem.limits.velocity, problem.limits.acceleration
    limits = [
        constraint.JointVelocityConstraint(np.stack((-V, V), axis=1)),
        constraint.JointAccelerationConstraint(np.stack((-A, A), axis=1)),
    ]
    found = algorithm.TOPPRA(limits, path, parametrizer="ParametrizeConstAccel")
    motion = found.compute_trajectory(0.0, 0.0)
    return float(motion.duration) if motion is not None else np.inf


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
        "toppra": toppra_duration(problem),
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


@click.command(help=__doc__.split("\n", maxsplit=1)[0])
@click.option("--tasks", "count", default=300, help="How many tasks.")
@click.option("--seed", default=14, help="Seed of the tasks.")
@click.option("--save", type=click.Path(path_type=Path), help="Folder for the results.")
def main(count: int, seed: int, save: Path | None) -> None:
    """Run all tasks and show the table."""
    console = Console()
    rows = [row(*task) for task in track(list(tasks(count, seed)), console=console)]
    table(rows).show(console)
    if save is not None:
        print(results.save(save, "timing", {"seed": seed, "tasks": count, "rows": rows}))


if __name__ == "__main__":
    main()
