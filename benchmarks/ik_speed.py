"""How long one solution takes, in processor time, beside other solvers."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import knotwork as kw
from ik_arms import LOOSE, TOLERANCE, Solver, arm, box, misses
from ik_peers import PEERS
from knotwork.arrays import FloatArray
from knotwork.robot import Robot


def speed(poses: int) -> dict[str, Any]:
    """Time of one solution, solvers in turn."""
    rows: list[dict[str, Any]] = []
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
            found, tuned = _speed_rows(solvers, robot, targets, starts)
            start = time.process_time()
            answer = kw.kinematics.solve_pose_ik_batch(robot, targets, starts)
            mean = 1e6 * (time.process_time() - start) / poses
            off = [misses(robot, p, one) for p, one in zip(targets, answer.q, strict=True)]
            batch: dict[str, Any] = {"mean_us": round(mean, 1), "to_tuned": round(mean / tuned, 2)}
            batch |= {"median_us": None, "p99_us": None, **_shares(off)}
            found["knotwork, solve_pose_ik_batch"] = batch
            rows += [
                {"arm": name, "start": label, "solver": solver, **row}
                for solver, row in found.items()
            ]
    return {"poses": poses, "rows": rows}


def _shares(off: list[float]) -> dict[str, float]:
    values = np.array(off)
    return {
        "percent_1e-8": round(100 * float(np.mean(values <= TOLERANCE)), 1),
        "percent_1e-4": round(100 * float(np.mean(values <= LOOSE)), 1),
    }


def _speed_rows(
    solvers: dict[str, Solver | str], robot: Robot, targets: list[Any], starts: FloatArray
) -> tuple[dict[str, dict[str, Any]], float]:
    """Figures of each solver; mean time of the tuned loop [µs]."""
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
            begin = time.process_time()
            try:
                answer = solve(pose, start)
            except Exception:  # whatever a peer raises counts as unsolved
                answer = None
            took[peer].append(time.process_time() - begin)
            off[peer].append(misses(robot, pose, answer))
    tuned = 1e6 * float(np.mean(took["tuned loop"]))
    found: dict[str, dict[str, Any]] = {}
    for peer, solve in solvers.items():
        if isinstance(solve, str):
            found[peer] = {"refused": solve}
            continue
        values = 1e6 * np.array(took[peer])
        found[peer] = {
            "mean_us": round(float(values.mean())),
            "to_tuned": round(float(values.mean()) / tuned, 2),
            "median_us": round(float(np.median(values))),
            "p99_us": round(float(np.percentile(values, 99))),
            **_shares(off[peer]),
        }
    return found, tuned
