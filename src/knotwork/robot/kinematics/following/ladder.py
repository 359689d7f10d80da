"""Self-motion over whole paths, by dynamic programming over a ladder of sampled configurations.

Rungs are poses along the paths. On each rung the redundancy (the elbow of a redundant arm, virtual
joints) is sampled, and projections of the samples of the previous rung are added. Configurations
that collide or violate limits are removed. Dynamic programming from the end gives the minimum-cost
sequence from each start. The sequence is smoothed and becomes a guide that self-motion follows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from knotwork.arrays import BoolArray, FloatArray, IndexArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.tool_paths import TimedPath
from knotwork.curves.tool_paths.rotations import rotation_angle
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.kinematics.chain.batch import Targets, solve_batch
from knotwork.robot.kinematics.chain.joint_ranges import turning_limits, whole_turns
from knotwork.robot.kinematics.chain.velocity import joint_scales
from knotwork.robot.kinematics.following.joint_field import Guide
from knotwork.robot.kinematics.sequence.candidates import PROJECTION_STEPS
from knotwork.robot.kinematics.sequence.nearness import limit_nearness, singular_nearness
from knotwork.robot.kinematics.solutions.self_motion import (
    choose_farthest_apart,
    sample_self_motion,
)

RUNG_SPACING = 0.03, 0.15
"""Distance between rungs [m, rad]."""
MIN_RUNGS, MAX_RUNGS = 6, 150
"""Minimum and maximum number of rungs per path."""
RUNG_GRID = 600
"""Number of samples for the length of a path."""
RUNG_SAMPLES = 64
"""Number of configurations on each rung, including projections of the previous rung."""
MAX_RUNG_MOVE = 0.6
"""Largest joint motion between rungs [rad or m]; after smoothing, half of it."""
LIMIT_CLEARANCE = 0.01
"""Margin to position limits, for the curves between samples [rad or m]."""
NEARNESS_COST = 0.02
"""Cost of a configuration on a limit or a singularity, as the square of a motion."""
SMOOTHING_SWEEPS, SMOOTHING_GAIN = 30, 1e-9
"""Sweeps of smoothing, and the smallest improvement that counts."""
MAX_SEQUENCES = 40
"""Maximum number of candidate sequences."""
RUNG_ERROR = 1e-9
"""Maximum pose error of a configuration on a rung [m, rad]."""

Clear = Callable[[FloatArray, float], BoolArray]


@dataclass(frozen=True, eq=False)
class _Rung:
    """Configurations at one pose, shape (m, d), and their costs, shape (m,)."""

    q: FloatArray
    cost: FloatArray


class Ladder:
    """Sampled configurations along consecutive paths, of which the cheapest sequence is a guide.

    Args:
        robot: The arm, with its virtual joints.
        paths: Paths, each of which starts at the end of the previous one.
        starts: Joint positions at the start of the first path [rad or m], shape (m, d).
        clear: Collision test: whether configurations (k, d) are collision-free at a time [s]; by
            default all are.
    """

    def __init__(
        self, robot: Robot, paths: Sequence[TimedPath], starts: FloatArray, clear: Clear | None
    ) -> None:
        self.robot = robot
        self.clear: Clear = clear or (lambda q, time: np.ones(len(q), dtype=bool))
        self.scale = joint_scales(robot)
        lower, upper = turning_limits(robot)
        self.limits = lower + LIMIT_CLEARANCE, upper - LIMIT_CLEARANCE
        self.unbounded = joint_axes(robot).is_revolute & ~np.isfinite(lower)
        self.rung_positions = [_spread_rungs(path) for path in paths]
        placed = [
            (path, s, min(path.start_time + t, path.end_time))
            for k, (path, positions) in enumerate(zip(paths, self.rung_positions, strict=True))
            for s, t in zip(
                positions[k > 0 :], path.timing.time_of(positions[k > 0 :]), strict=True
            )
        ]
        self.time = np.array([time for _, _, time in placed])
        self.targets = Targets.from_poses([_evaluate_pose(*rung) for rung in placed])
        self.rungs = self._sample_rungs(starts)

    def _sample_rungs(self, starts: FloatArray) -> list[_Rung]:
        fresh = sample_self_motion(self.robot, self.targets)
        cost = np.where(self.clear(starts, float(self.time[0])), 0.0, np.inf)
        rungs = [_Rung(starts, cost + self._nearness(starts))]
        # later rungs do not depend on the starts, so the result of a start does not depend on the
        # others
        before = choose_farthest_apart(self.robot, fresh[0], RUNG_SAMPLES)
        for i in range(1, len(self.targets)):
            projected, converged = self._project(np.full(len(before), i), before)
            q = choose_farthest_apart(
                self.robot, np.vstack([projected[converged], fresh[i]]), RUNG_SAMPLES
            )
            q = q[self.clear(q, float(self.time[i]))]
            rungs.append(_Rung(q, self._nearness(q)))
            before = q
        return rungs

    def _nearness(self, q: FloatArray) -> FloatArray:
        """Cost of nearness to singularities and to limits that no whole turn avoids, (m,)."""
        if not len(q):
            return np.zeros(0)
        singular = singular_nearness(joint_axes(self.robot).jacobians(q))
        return np.asarray(NEARNESS_COST * (limit_nearness(q, self.limits) + singular))

    def _project(self, rungs: IndexArray, q: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Project configurations onto the poses of rungs; also give whether each one converged."""
        if not len(q):
            return q, np.zeros(0, dtype=bool)
        ended = solve_batch(
            self.robot,
            self.targets.take(rungs),
            q,
            tolerance=RUNG_ERROR,
            limits=self.limits,
            max_iterations=PROJECTION_STEPS,
        )
        return ended.q, ended.converged & (np.abs(ended.q - q).max(axis=1) <= MAX_RUNG_MOVE)

    def _move(self, start: FloatArray, end: FloatArray) -> FloatArray:
        move = end - start
        return np.asarray(move - np.where(self.unbounded, whole_turns(move), 0.0))

    def find_guided_starts(self, count: int) -> Iterator[tuple[int, list[Guide]]]:
        """Find starts that reach the end, by index, the cheapest first, each with a guide per path.

        Args:
            count: Maximum number of starts.
        """
        costs = [self._costs(rung, after) for rung, after in pairwise(self.rungs)]
        tried = np.zeros(len(self.rungs[0].q), dtype=bool)
        for _ in range(MAX_SEQUENCES):
            values = [self.rungs[-1].cost]
            for rung, cost in zip(self.rungs[-2::-1], reversed(costs), strict=True):
                values.insert(0, rung.cost + (cost + values[0]).min(axis=1, initial=np.inf))
            start = int(np.where(tried, np.inf, values[0]).argmin())
            if tried.sum() == count or tried[start] or np.isinf(values[0][start]):
                return
            nodes = [start]
            for cost, value in zip(costs, values[1:], strict=True):
                nodes.append(int((cost[nodes[-1]] + value).argmin()))
            q = np.array([rung.q[k] for rung, k in zip(self.rungs, nodes, strict=True)])
            moves = self._move(q[:-1], q[1:])
            q = self._smooth(np.vstack([q[:1], q[0] + np.cumsum(moves, axis=0)]))
            jumps = np.flatnonzero((np.abs(np.diff(q, axis=0)) > 0.5 * MAX_RUNG_MOVE).any(axis=1))
            for i in jumps:  # self-motion does not connect these configurations
                costs[i][nodes[i], nodes[i + 1]] = np.inf
            if not jumps.size:
                tried[start] = True
                yield start, self._guides(q)

    def _costs(self, rung: _Rung, after: _Rung) -> FloatArray:
        """Cost of each step from one rung to the next, shape (m, k)."""
        move = self._move(rung.q[:, None], after.q[None])
        cost = np.einsum("abj,j->ab", move**2, self.scale**-2.0)
        return np.where((np.abs(move) > MAX_RUNG_MOVE).any(axis=2), np.inf, cost)

    def _smooth(self, q: FloatArray) -> FloatArray:
        """Move every other rung's configuration towards the middle of its neighbours.

        A move is kept only if it costs less and is collision-free.
        """
        last = len(q) - 1
        costs = self._nearness(q)
        for sweep in range(2 * SMOOTHING_SWEEPS):
            rows = np.arange(1 + sweep % 2, last + 1, 2)
            before, after = q[rows - 1], q[np.minimum(rows + 1, last)]
            after = np.where((rows == last)[:, None], before, after)
            projected, converged = self._project(rows, 0.5 * (before + after))
            nearness = self._nearness(projected)
            gain = self._squared_moves(q[rows], before, after) + costs[rows]
            gain -= self._squared_moves(projected, before, after) + nearness
            better = converged & (gain > SMOOTHING_GAIN)
            for k in np.flatnonzero(better):
                better[k] = self.clear(projected[k : k + 1], float(self.time[rows[k]]))[0]
            if not better.any() and sweep % 2:
                break
            q[rows[better]], costs[rows[better]] = projected[better], nearness[better]
        return q

    def _squared_moves(self, q: FloatArray, before: FloatArray, after: FloatArray) -> FloatArray:
        squares = (q - before) ** 2 + (after - q) ** 2
        return np.asarray(squares @ self.scale**-2.0)

    def _guides(self, q: FloatArray) -> list[Guide]:
        """Make a smooth curve of postures along each path."""
        from scipy.interpolate import CubicSpline

        guides, first = [], 0
        for positions in self.rung_positions:
            postures = q[first : first + len(positions)]
            first += len(positions) - 1
            curve = CubicSpline(positions, postures, bc_type="natural")
            guides.append(Guide(PiecewisePolynomial(curve.c, curve.x)))
        return guides


def _spread_rungs(path: TimedPath) -> FloatArray:
    """Spread the rungs evenly over distance and rotation, independent of speed."""
    s = np.linspace(0.0, path.tool_path.length, RUNG_GRID)
    steps = np.diff(path.tool_path.rotation(s), axis=0)
    turned = rotation_angle(np.linalg.norm(steps, axis=(1, 2)))
    far = np.cumsum(np.append(0.0, np.diff(s) / RUNG_SPACING[0] + turned / RUNG_SPACING[1]))
    count = int(np.clip(np.ceil(far[-1]), MIN_RUNGS, MAX_RUNGS))
    positions = np.interp(np.linspace(0.0, far[-1], count + 1), far, s)
    positions[-1] = s[-1]
    return np.asarray(positions)


def _evaluate_pose(path: TimedPath, s: float, time: float) -> Any:
    """Pose of the tool; without a moving frame it does not depend on rounded times."""
    return path.pose(time) if path.has_own_clock else path.tool_path.pose(s)
