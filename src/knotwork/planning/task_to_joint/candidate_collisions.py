"""Collisions of candidate solutions at waypoints and along paths."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import BoolArray, FloatArray
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.errors import CollisionError, FollowingObstruction
from knotwork.robot import Robot
from knotwork.robot.kinematics.following.continuation import Continuation
from knotwork.robot.kinematics.sequence.candidates import Candidates
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.waypoints import CartesianWaypoint

if TYPE_CHECKING:
    from knotwork.scene.bodies import Body
    from knotwork.scene.collision_model import CollisionModel

COLLISION_SAMPLES = 24
"""Number of times along a path at which candidates are tested for collisions.

The proof is part of the check.
"""

CONTACT_TIME_PRECISION = 1e-6
"""Precision of the time at which a contact begins [s]."""

ENOUGH_CLEARANCE = 0.1
"""Clearance [m] above which a larger one is not preferred."""


def unsolved_collision_model(
    scenario: Scenario, joints: ScenarioJoints, robot: Robot, times: FloatArray
) -> CollisionModel:
    """The collision model of a scenario whose poses are not solved yet.

    Args:
        scenario: The scenario.
        joints: The joints of the scenario.
        robot: The robot without virtual joints.
        times: Times of the waypoints at which bodies come, go or are held, shape (n,).
    """
    from knotwork.scene.building import build_collision_model

    poses = []
    if scenario.scene.held:
        for waypoint, state in zip(scenario.waypoints, joints.targets, strict=True):
            if isinstance(waypoint, CartesianWaypoint):
                poses.append(waypoint.pose)
            elif state is not None:
                poses.append(robot.forward(state.position[: robot.dof]))
    return build_collision_model(scenario, robot, times.tolist(), poses)


class CandidateCollisions:
    """Tests solutions of a scenario's waypoints for collisions, there and along paths.

    Args:
        scenario: The scenario.
        robot: The robot without virtual joints; only its joint positions are used.
        model: Its collision model, with one pair or more.
    """

    def __init__(self, scenario: Scenario, robot: Robot, model: CollisionModel) -> None:
        from knotwork.scene.solid_pairs import SolidPairs

        self.scenario, self.robot, self.model = scenario, robot, model
        self._pairs = SolidPairs(model)

    @classmethod
    def for_scenario(
        cls, scenario: Scenario, joints: ScenarioJoints, robot: Robot
    ) -> CandidateCollisions | None:
        """The tests of a scenario; `None` if nothing in it can collide.

        Args:
            scenario: The scenario.
            joints: The joints of the scenario.
            robot: The robot without virtual joints.
        """
        if not scenario.scene.is_checked:
            return None
        model = unsolved_collision_model(scenario, joints, robot, scenario.expected_times)
        return cls(scenario, robot, model) if model.pairs else None

    def check_start(self, q: FloatArray) -> None:
        """Check that no static object touches the robot at its start.

        Args:
            q: Joint positions at the start [rad or m], shape (d,).

        Raises:
            CollisionError: An object touches the robot.
        """
        held = {held_object.name for held_object in self.scenario.scene.held}
        margin = self.scenario.scene.margin
        start = float(self.scenario.expected_times[0])
        if self._is_clear(q, start):
            return
        for distance, first, second in self._gaps(q, start):
            # an object that is picked up at the start is no longer static
            is_static = first.kind == "object" and not first.joint and first.end > start
            if distance <= -margin and is_static and second.kind != "held":
                location = ("tool", "holds") if first.name in held else ("scene", "objects")
                scale, unit = self.scenario.units.per_metre, self.scenario.units.length
                shortfall = -(distance + margin)
                raise CollisionError(
                    f"touches {second.name} where the robot starts, by {scale * shortfall:.4g} "
                    f"{unit}; move the object, or allow the contact: `allow: [{second.name}]`",
                    bodies=(first.name, second.name),
                    shortfall=shortfall,
                    where=self.scenario.where(*location, first.name),
                )

    def collision_cost(self, index: int, candidates: Candidates) -> FloatArray:
        """1 for each candidate at a waypoint that collides, otherwise 0; shape (m,)."""
        return (self._branch_clearance(index, candidates, 0.0) < 0.0).astype(float)

    def clearance_cost(self, index: int, candidates: Candidates) -> FloatArray:
        """Cost of a small clearance for each candidate, 0 to 1, shape (m,)."""
        clearance = np.maximum(self._branch_clearance(index, candidates, ENOUGH_CLEARANCE), 0.0)
        return np.asarray(1.0 - clearance / ENOUGH_CLEARANCE)

    def are_clear(self, q: FloatArray, time: float) -> BoolArray:
        """Whether configurations (k, d) are free of collisions at a time, shape (k,)."""
        return np.asarray(self._pairs.min_gaps(self._arm_positions(q), time) >= 0.0)

    def _is_clear(self, q: FloatArray, time: float) -> bool:
        return bool(self.are_clear(q[None], time)[0])

    def _branch_clearance(
        self, index: int, candidates: Candidates, max_clearance: float
    ) -> FloatArray:
        """Clearance of candidates, computed once per branch: turns do not change it."""
        _, firsts, branches = np.unique(candidates.branch, return_index=True, return_inverse=True)
        time = self.scenario.waypoints[index].time
        q = self._arm_positions(candidates.q[firsts])
        return np.asarray(self._pairs.min_gaps(q, time, max_clearance)[branches])

    def _arm_positions(self, q: FloatArray) -> FloatArray:
        return np.ascontiguousarray(q[:, : self.robot.dof])

    def find_colliding_step(self, path: Continuation, start: int, count: int) -> int | None:
        """Find the first of some steps along a path that collides; `None` if none does.

        Args:
            path: The continuations along the path.
            start: Index of the continuation.
            count: Number of steps to test.
        """
        steps = np.flatnonzero(np.isfinite(path.position[:, start]).all(axis=1))
        steps = steps[sort_distinct(np.linspace(0, len(steps) - 1, count).astype(np.intp))]
        q = self._arm_positions(path.position[steps, start])
        gaps = (gap for gap, _ in self._pairs.nearest_pairs(q, path.time[steps], 0.0))
        return next((int(k) for k, gap in zip(steps, gaps, strict=False) if gap < 0.0), None)

    def find_collision_start(
        self, path: Continuation, start: int, colliding: int
    ) -> FollowingObstruction:
        """Find the beginning of the first collision along a path.

        Args:
            path: The continuations along the path.
            start: Index of the continuation.
            colliding: Step returned by `find_colliding_step`.
        """
        q, time = path.position[:, start], path.time.tolist()
        step = next((i for i in range(colliding) if not self._is_clear(q[i], time[i])), colliding)
        _, first, second = min(self._gaps(q[step], time[step]), key=lambda gap: gap[0])
        begins = FollowingObstruction("collision", time[step], bodies=(second.name, first.name))
        if step == 0 or not time[step - 1] < time[step]:
            return begins
        from scipy.interpolate import CubicHermiteSpline
        from scipy.optimize import bisect

        rows = slice(step - 1, step + 1)
        motion = CubicHermiteSpline(path.time[rows], q[rows], path.velocity[rows, start])

        def sign(t: float) -> float:
            return 1.0 if self._is_clear(motion(t), t) else -1.0

        return begins._replace(time=float(bisect(sign, *time[rows], xtol=CONTACT_TIME_PRECISION)))

    def _gaps(self, q: FloatArray, time: float) -> Iterator[tuple[float, Body, Body]]:
        """Distance of each pair minus its required clearance, and the pair."""
        from knotwork.scene.distances import find_nearest_points

        rotation, origin = (
            x[0]
            for x in self.model.joint_placements(self._arm_positions(q[None]), np.array([time]))
        )
        for pair in self.model.pairs:
            first, second = self.model.bodies[pair.first], self.model.bodies[pair.second]
            if max(first.start, second.start) <= time <= min(first.end, second.end):
                near = find_nearest_points(first, second, rotation, origin)
                yield near.distance - pair.required_clearance, first, second
