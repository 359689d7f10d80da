"""How long one solution takes, beside other solvers."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from rich.table import Table

import knotwork as kw
from ik_arms import LOOSE, TOLERANCE, Solver, arm, box, misses
from ik_peers import PEERS
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray


def speed(poses: int) -> Table:
    """Time of one solution, solvers in turn."""
    table = Table(title=f"One solution, {poses} poses, one thread [µs]", title_justify="left")
    columns = ("arm", "start", "solver", "mean", "/ tuned", "median", "p99", "to 1e-8", "to 1e-4")
    for column in columns:
        table.add_column(column)
    for name in ("ur5", "panda"):
        robot, generator = arm(name), np.random.default_rng(46)
        lower, upper = box(robot)
        solvers: dict[str, Solver | str] = {}
        for peer, make in PEERS.items():
            try:
                solvers[peer] = make(robot)
            except ImportError:
                solvers[peer] = "not installed"
            except Exception as error:  # a peer may refuse an arm in a way of its own
                solvers[peer] = f"does not take this arm: {str(error).splitlines()[0][:60]}"
        q = generator.uniform(lower, upper, (poses, robot.dof))
        targets = [robot.forward(one) for one in q]
        random = generator.uniform(lower, upper, q.shape)
        near = np.clip(q + generator.uniform(-0.1, 0.1, q.shape), lower, upper)
        for label, starts in (("random", random), ("near", near)):
            tuned = _speed_rows(table, robot, label, solvers, targets, starts)
            start = time.perf_counter()
            answer = kw.solve_many(robot, targets, starts)
            mean = 1e6 * (time.perf_counter() - start) / poses
            relative = f"{mean / tuned:.2f}"
            off = [misses(robot, p, one) for p, one in zip(targets, answer.q, strict=True)]
            cells = (f"{mean:.1f}", relative, "-", "-", *_shares(off))
            table.add_row(name, label, "knotwork, solve_many", *cells)
    return table


def _shares(off: list[float]) -> tuple[str, str]:
    values = np.array(off)
    return f"{np.mean(values <= TOLERANCE):.1%}", f"{np.mean(values <= LOOSE):.1%}"


def _speed_rows(
    table: Table,
    robot: Robot,
    label: str,
    solvers: dict[str, Solver | str],
    targets: list[Any],
    starts: FloatArray,
) -> float:
    """Add a row for each solver; mean time of the tuned loop [µs]."""
    took: dict[str, list[float]] = {peer: [] for peer in solvers}
    off: dict[str, list[float]] = {peer: [] for peer in solvers}
    generator, names = np.random.default_rng(47), list(solvers)
    for pose, start in zip(targets, starts, strict=True):
        # In an order of its own for each pose: who comes after a solver that uses the same
        # libraries finds them in the processor's cache.
        for peer in generator.permutation(names):
            solve = solvers[peer]
            if isinstance(solve, str):
                continue
            begin = time.perf_counter()
            try:
                answer = solve(pose, start)
            except Exception:  # whatever a peer raises counts as unsolved
                answer = None
            took[peer].append(time.perf_counter() - begin)
            off[peer].append(misses(robot, pose, answer))
    tuned = 1e6 * float(np.mean(took["tuned loop"]))
    for peer, solve in solvers.items():
        if isinstance(solve, str):
            table.add_row(robot.name, label, peer, solve)
            continue
        values = 1e6 * np.array(took[peer])
        mean, median, last = values.mean(), np.median(values), np.percentile(values, 99)
        cells = (f"{mean:.0f}", f"{mean / tuned:.2f}", f"{median:.0f}", f"{last:.0f}")
        table.add_row(robot.name, label, peer, *cells, *_shares(off[peer]))
    return tuned
