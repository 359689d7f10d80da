"""`AlongPath`: the joints' motion along one tool path, and the limits that it exceeds where."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from knotwork.choosing.task import FreeTask, knots_of
from knotwork.interpolation import ModifiedHermiteSpline
from knotwork.joint_quantities import DERIVATIVES
from knotwork.polynomial.refined import part
from knotwork.scenario import Scenario, ScenarioPath
from knotwork.task_to_joint import followed_path, leads_along, way_along
from knotwork.trajectory import JointTrajectory

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.verification import Bound

INSIDE = 1.0 - 1e-9
"""Part of a limit that a peak may reach."""

ROOM = 1e-3
"""Joints could follow the path itself faster by this part of the speed.

Their speeds are read between steps, which are others where more starts are followed at once.
"""


class Hindrance(NamedTuple):
    """What a motion exceeds.

    Attributes:
        who: Name of a joint or a frame; empty for the tool, or where it is not known.
        quantity: What is limited.
    """

    who: str
    quantity: str


class Excess(NamedTuple):
    """A peak of a joint that is beyond a limit.

    Attributes:
        joint: Index of the joint.
        quantity: `"velocity"`, `"acceleration"` or `"jerk"`.
        peak: Its greatest magnitude [rad or m, and per s as the quantity is].
    """

    joint: int
    quantity: str
    peak: float


class AlongPath:
    """The joints' motion along one tool path of a task, at any speeds.

    Args:
        task: The task.
        path: One of its paths.
    """

    def __init__(self, task: FreeTask, path: ScenarioPath) -> None:
        known = task.waypoints
        self.space, self.limits = task.space, task.scenario.motion_limits
        self.number = task.scenario.paths.index(path)
        self.start = known.position[np.abs(known.time - path.stretches[0].start).argmin()]

    def motion(self, scenario: Scenario, way: Any = None) -> JointTrajectory:
        """The joints' motion along the path, as it is planned.

        Args:
            scenario: The task with some speeds.
            way: The way along the path at these speeds, if it is known.

        Raises:
            PathError: The arm can't follow the path, or not within its tolerances.
        """
        path, knots = scenario.paths[self.number], knots_of(scenario)
        time, _, q, v, a, _ = followed_path(
            scenario, self.space.robot, path, self.start, knots, way
        )
        curve = ModifiedHermiteSpline(time, q, v, knots=knots, acceleration=a)
        return JointTrajectory(self.space.joint_names, curve, joint_units=self.space.joint_units)

    def hindrances(self, scenario: Scenario) -> dict[int, Hindrance]:
        """What the motion exceeds, by index of those stretches where it exceeds something.

        Raises:
            PathError: The arm can't follow the path, or not within its tolerances.
        """
        path = scenario.paths[self.number]
        way = way_along(scenario, self.space.robot, path, self.start)
        leads = leads_along(self.space.robot, path, way, ROOM)
        found = {k: Hindrance("", "velocity") for k, fine in enumerate(leads) if not fine}
        if np.isfinite(way.lost).any():
            return found
        motion = self.motion(scenario, way)
        for k in range(len(leads)):
            if k not in found and (held := self._exceeded(self.on_stretch(motion, path, k))):
                found[k] = held
        return found

    def on_stretch(self, motion: JointTrajectory, path: ScenarioPath, k: int) -> JointTrajectory:
        """The part of a motion along the path that one stretch takes."""
        stretch, curve = path.stretches[k], motion.polynomial
        start, end = np.clip((stretch.start, stretch.end), curve.x[0], curve.x[-1])
        return JointTrajectory(
            motion.joint_names, part(curve, start, end), joint_units=motion.joint_units
        )

    def joint_beyond(self, motion: JointTrajectory, most: float) -> Excess | None:
        """What of the joints' motion is beyond that part of a limit, if anything is."""
        for quantity in DERIVATIVES[1:]:
            peak = motion.extrema(quantity).peak
            shares = peak / self.space.limits[quantity]
            joint = int(np.argmax(shares))
            if shares[joint] > most:
                return Excess(joint, quantity, float(peak[joint]))
        return None

    def _exceeded(self, motion: JointTrajectory) -> Hindrance | None:
        """What a motion exceeds; `None` if it keeps every limit."""
        beyond = self.joint_beyond(motion, INSIDE)
        if beyond is not None:
            return Hindrance(self.space.joint_names[beyond.joint], beyond.quantity)
        if self.space.robot is None:
            return None
        bounds = self._bounds(self.space.robot, motion)
        return next((held for held, bound in bounds if not proved(bound)), None)

    def _bounds(self, robot: Robot, motion: JointTrajectory) -> Iterator[tuple[Hindrance, Bound]]:
        """Proved bounds of what is limited beside the joints' motion, one after another."""
        from knotwork.verification import (
            tool_acceleration_bound,
            tool_speed_bound,
            torque_bound,
        )

        limits = self.limits
        if limits.tool_speed is not None:
            bound = tool_speed_bound(robot, motion, limit=limits.tool_speed)
            yield Hindrance("", "tool speed"), bound
        if limits.tool_acceleration is not None:
            bound = tool_acceleration_bound(robot, motion, limit=limits.tool_acceleration)
            yield Hindrance("", "tool acceleration"), bound
        for one in limits.frame_speed:
            bound = tool_speed_bound(robot, motion, frame=one.frame, limit=one.speed)
            yield Hindrance(one.frame, "speed"), bound
        if np.isfinite(self.space.limits["effort"]).any():
            efforts = torque_bound(robot, motion)
            for joint, bound in zip(self.space.joint_names, efforts, strict=True):
                yield Hindrance(joint, "effort"), bound


def proved(bound: Bound) -> bool:
    """Whether a limit is kept, if there is one."""
    return bound.limit is None or (bound.proved and bound.bound <= bound.limit)
