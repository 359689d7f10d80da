"""Collisions of candidate solutions at waypoints and along paths."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from knotwork.errors import CollisionError
from knotwork.kinematics.following.continuation import Continuation
from knotwork.kinematics.sequence.candidates import Candidates
from knotwork.polynomial.distinct import distinct
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.waypoints import CartesianWaypoint, FloatArray

if TYPE_CHECKING:
    from knotwork.scene.bodies import Body

LOOKS = 24
"""Number of times along a path at which candidates are tested; the check proves the rest."""

HALVINGS = 20
"""Of the step in which a contact begins."""

FAR = 0.1
"""Where clearance is preferred, all that is farther away than this [m] is as good."""


class Obstacles:
    """Collisions of configurations of a scenario's robot.

    Args:
        scenario: The task.
        space: The joints it is for.
        robot: Their robot, without virtual joints: of joint positions only its own count.
    """

    def __init__(self, scenario: Scenario, space: JointSpace, robot: Robot) -> None:
        from knotwork.scene.building import collision_model
        from knotwork.scene.solid_pairs import SolidPairs

        poses = []
        if scenario.scene.held:
            for waypoint, state in zip(scenario.waypoints, space.targets, strict=True):
                if isinstance(waypoint, CartesianWaypoint):
                    poses.append(waypoint.pose)
                elif state is not None:
                    poses.append(robot.forward(state.position[: robot.dof]))
        self.scenario, self.robot = scenario, robot
        self.model = collision_model(scenario, robot, scenario.provisional_times.tolist(), poses)
        self._pairs = SolidPairs(self.model) if self.model.pairs else None

    def check_start(self, q: FloatArray) -> None:
        """Check that nothing that stands around touches the robot where it starts.

        Args:
            q: Joint positions at the start [rad or m], shape (d,).

        Raises:
            CollisionError: An object does.
        """
        held = {one.name for one in self.scenario.scene.held}
        margin = self.scenario.scene.rules.margin
        start = float(self.scenario.provisional_times[0])
        for distance, first, second in self._gaps(q, start):
            # what is taken at the start does not stand any more
            stands = first.kind == "object" and not first.joint and first.end > start
            if distance <= -margin and stands and second.kind != "held":
                place = ("tool", "holds") if first.name in held else ("scene", "objects")
                scale, unit = self.scenario.shown_length
                with self.scenario.error_context(*place, first.name):
                    depth = f"{-scale * (distance + margin):.4g} {unit}"
                    raise CollisionError(
                        f"touches {second.name} where the robot starts, by {depth}; move it, or "
                        f"if it may touch it say `allow: [{second.name}]`",
                        names=(first.name, second.name),
                        depth=-(distance + margin),
                    )

    def collide(self, index: int, candidates: Candidates) -> FloatArray:
        """1 for each candidate at a waypoint that collides, otherwise 0; shape (m,)."""
        return (self._of_branches(index, candidates, 0.0) < 0.0).astype(float)

    def shortfall(self, index: int, candidates: Candidates) -> FloatArray:
        """How much clearance each candidate lacks, shape (m,): larger where others are near."""
        clearance = np.maximum(self._of_branches(index, candidates, FAR), 0.0)
        return np.asarray(1.0 - clearance / FAR)

    def clear(self, q: FloatArray, time: float) -> NDArray[np.bool_]:
        """Which configurations (k, d) are clear of collisions at a time, shape (k,)."""
        if self._pairs is None:
            return np.ones(len(q), dtype=bool)
        return np.asarray(self._pairs.clearance(self._own(q), time) >= 0.0)

    def collides(self, q: FloatArray, time: float) -> bool:
        """Whether a configuration collides."""
        return not self.clear(q[None], time)[0]

    def _of_branches(self, index: int, candidates: Candidates, most: float) -> FloatArray:
        """Clearance of candidates; turns make no difference to it."""
        if self._pairs is None:
            return np.full(len(candidates.q), most)
        _, own, back = np.unique(candidates.branch, return_index=True, return_inverse=True)
        time = self.scenario.waypoints[index].time
        return np.asarray(self._pairs.clearance(self._own(candidates.q[own]), time, most)[back])

    def _own(self, q: FloatArray) -> FloatArray:
        return np.ascontiguousarray(q[:, : self.robot.dof])

    def contact(self, found: Continuation, start: int, count: int = LOOKS) -> int | None:
        """The first of some steps of a way along a path that collides; `None` if none does.

        Args:
            found: The ways.
            start: Which of them.
            count: At how many steps to look.
        """
        if self._pairs is None:
            return None
        steps = np.flatnonzero(np.isfinite(found.position[:, start]).all(axis=1))
        looks = steps[distinct(np.linspace(0, len(steps) - 1, count).astype(np.intp))]
        q = self._own(found.position[looks, start])
        gaps = self._pairs.clearances(q, found.time[looks])
        return next((int(k) for k, gap in zip(looks, gaps, strict=False) if gap < 0.0), None)

    def described(self, found: Continuation, start: int, contact: int) -> tuple[float, str]:
        """When a contact begins, and the sentence for it.

        Args:
            found: The ways.
            start: Which of them.
            contact: What `contact` gives for it.
        """
        q, time = found.position[:, start], found.time.tolist()
        step = next((i for i in range(contact) if self.collides(q[i], time[i])), contact)
        gaps = self._gaps(q[step], time[step])
        _, one, other = min(gaps, key=lambda gap: gap[0])
        return self._begin(found, step, start), f"{other.name} comes too near to {one.name}"

    def _begin(self, found: Continuation, step: int, start: int) -> float:
        """When the contact begins that is there at a step and not at the one before [s]."""
        high = float(found.time[step])
        if step == 0 or not found.time[step - 1] < high:
            return high
        from scipy.interpolate import CubicHermiteSpline

        low, rows = float(found.time[step - 1]), slice(step - 1, step + 1)
        way = CubicHermiteSpline(
            found.time[rows], found.position[rows, start], found.velocity[rows, start]
        )
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            if self.collides(way(middle), middle):
                high = middle
            else:
                low = middle
        return high

    def _gaps(self, q: FloatArray, time: float) -> Iterator[tuple[float, Body, Body]]:
        """Distance of each pair beyond the required margin, and the pair."""
        from knotwork.scene.distances import nearest_of_bodies

        rotation, origin = (x[0] for x in self.model.placed(self._own(q[None]), np.array([time])))
        for pair in self.model.pairs:
            first, second = self.model.bodies[pair.first], self.model.bodies[pair.second]
            if max(first.start, second.start) <= time <= min(first.end, second.end):
                near = nearest_of_bodies(self.model.meter, first, second, rotation, origin)
                yield near.distance - pair.margin, first, second
