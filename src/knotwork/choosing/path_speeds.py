"""The greatest constant speed along each tool path that gives none.

The joints' motion along the path is made as it will be planned, and its exact peaks are compared
with the limits, as are the speeds of joints that follow the path itself. The speed is found by
bisection.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.choosing.task import FreeTask, knots_of
from knotwork.choosing.tool_speeds import greatest_path_speed, path_error
from knotwork.documents import Location
from knotwork.errors import DocumentError, InputError, PathError, together
from knotwork.interpolation import ModifiedHermiteSpline
from knotwork.scenario import Scenario, ScenarioPath
from knotwork.scenario.free_times import PROVISIONAL_SPEED
from knotwork.task_to_joint import followed_path, leads_along
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.verification import Bound

DIGITS = 4
"""Speeds are rounded down to so many digits."""

ROUNDS = 12
"""Bisections of a factor of two: they leave less than two units of the last digit."""

STEP = 1.5
"""Speeds tried one after another, until one keeps the limits, differ by this factor."""

SLOWEST = 0.1 * PROVISIONAL_SPEED
"""No speed below this is tried [m/s]."""

INSIDE = 1.0 - 1e-9
"""Part of a limit that a peak may reach."""

TOOL_ROOM = 1e-3
"""Along a path the tool stays below its limit by this part of it, so that it can be approached."""

ROOM = 1e-3
"""Joints could follow the path itself faster by this part of the speed.

Their speeds are read between steps, which are others where more starts are followed at once.
"""


def path_speeds(task: FreeTask) -> dict[Location, Any]:
    """The edits that give each stretch its speed.

    Stretches of one path are slowed down together until the whole path keeps the limits.

    Raises:
        InputError: Nothing bounds a speed, or the limits allow none.
    """
    free, positions = task.free, task.waypoints
    edits: dict[Location, Any] = {}
    for path in task.scenario.paths:
        stretches = [
            k
            for k in range(len(path.stretches))
            if free.index[path.first + 1 + k] in free.path_speed
        ]
        if stretches:
            row = int(np.abs(positions.time - path.stretches[0].start).argmin())
            search = _Search(task, path, stretches, positions.position[row])
            edits |= search.edits(search.speeds())
    return edits


class _Search:
    """The search for the speeds of one path."""

    def __init__(
        self,
        task: FreeTask,
        path: ScenarioPath,
        stretches: list[int],
        start: FloatArray,
    ) -> None:
        scenario, free = task.scenario, task.free
        self.task, self.scenario, self.space, self.start = task, scenario, task.space, start
        self.path, self.stretches = path, stretches
        self.places = [free.index[path.first + 1 + k] for k in stretches]
        most = (1.0 - TOOL_ROOM) * (scenario.motion_limits.tool_speed or math.inf)
        self.caps = [min(free.path_speed[place], most) for place in self.places]
        self.number = scenario.paths.index(path)
        self.unit = scenario.shown_length[0]
        self.hindrance = ""  # at the speeds that were tried last

    def edits(self, speeds: list[float]) -> dict[Location, Any]:
        """The edits for some speeds [m/s]."""
        pairs = zip(self.places, speeds, strict=True)
        return {("waypoints", place, "speed"): _rounded(self.unit * v) for place, v in pairs}

    def speeds(self) -> list[float]:
        """The greatest speeds that keep all limits [m/s]."""
        motion = self.motion(self.scenario)
        # at a speed at which the ends exceed a limit, they say nothing of the rest
        orders = 3 if self._kept(motion) else 1
        rooms = [self._room(motion, k, orders) for k in self.stretches]
        if np.isinf([min(*pair) for pair in zip(rooms, self.caps, strict=True)]).any():
            self._refuse(
                "nothing bounds the speed along it", "speed: {at_most: a speed}, or limits"
            )
        # those that nothing else bounds go at their greatest speeds
        likely = [PROVISIONAL_SPEED * (room if np.isfinite(room) else 1e9) for room in rooms]

        def at(factor: float) -> list[float]:
            pairs = zip(likely, self.caps, strict=True)
            return [min(max(factor * speed, SLOWEST), cap) for speed, cap in pairs]

        low, high = 0.0, 1.0
        while self._feasible(at(high)):
            low, high = high, 2.0 * high
            if at(low) == self.caps:
                return at(low)
        # a lower speed is not always easier: its changes of speed at the ends are shorter
        slowest = PROVISIONAL_SPEED / max(likely)
        while not low:
            if high <= slowest:
                self._refuse(self._tried(at(1.0)))
            lower = max(high / STEP, slowest)
            if self._feasible(at(lower)):
                low = lower
            else:
                high = lower
        for _ in range(ROUNDS):
            middle = math.sqrt(low * high)
            if self._feasible(at(middle)):
                low = middle
            else:
                high = middle
        return at(low)

    def _tried(self, speeds: list[float]) -> str:
        least, most = (f"{self.unit * v:.4g}" for v in (PROVISIONAL_SPEED, max(speeds)))
        if max(speeds) <= PROVISIONAL_SPEED:
            return f"the limits allow less than {least} along it"
        said = f"no speed from {least} to {most} was found at which the limits are kept along it"
        return f"{said}; at {least} {self.hindrance}" if self.hindrance else said

    def _refuse(self, found: str, accepted: str = "higher limits, or another path") -> None:
        with self.scenario.error_context("waypoints", self.places[0], "speed"):
            raise InputError(f"{found}; accepted: {accepted}")

    def motion(self, scenario: Scenario) -> JointTrajectory:
        """The joints' motion along the path, as it is planned."""
        path, knots = scenario.paths[self.number], knots_of(scenario)
        time, _, q, v, a = followed_path(scenario, self.space.robot, path, self.start, knots)
        curve = ModifiedHermiteSpline(time, q, v, knots=knots, acceleration=a)
        return JointTrajectory(self.space.joint_names, curve, joint_units=self.space.joint_units)

    def _feasible(self, speeds: list[float]) -> bool:
        try:
            scenario = self.task.with_edits(self.edits(speeds))
            path = scenario.paths[self.number]
            self.hindrance = ""
            return leads_along(
                scenario, self.space.robot, path, self.start, room=ROOM
            ) and self._kept(self.motion(scenario))
        except (
            PathError,
            DocumentError,
        ):  # too short for its changes of speed, or its tolerances are too fine
            return False

    def _kept(self, motion: JointTrajectory) -> bool:
        limits = self.space.limits
        for quantity in ("velocity", "acceleration", "jerk"):
            if not np.isfinite(limits[quantity]).any():
                continue
            shares = motion.extrema(quantity).peak / limits[quantity]
            if (shares > INSIDE).any():
                joint = self.space.joint_names[int(np.argmax(shares))]
                self.hindrance = f"{joint!r} exceeds its limit of {quantity}"
                return False
        if self.space.robot is None:
            return True
        for what, bound in self._bounds(self.space.robot, motion):
            if not _proved(bound):
                self.hindrance = f"the limit of {what} is not kept"
                return False
        return True

    def _bounds(self, robot: Robot, motion: JointTrajectory) -> Iterator[tuple[str, Bound]]:
        """Proved bounds of what is limited beside the joints' motion, one after another."""
        from knotwork.verification import (
            tool_acceleration_bound,
            tool_speed_bound,
            torque_bound,
        )

        limits = self.scenario.motion_limits
        if limits.tool_speed is not None:
            yield "tool_speed", tool_speed_bound(robot, motion, limit=limits.tool_speed)
        if limits.tool_acceleration is not None:
            most = limits.tool_acceleration
            yield "tool_acceleration", tool_acceleration_bound(robot, motion, limit=most)
        for one in limits.frame_speed:
            bound = tool_speed_bound(robot, motion, frame=one.frame, limit=one.speed)
            yield f"the speed of {one.frame}", bound
        if np.isfinite(self.space.limits["effort"]).any():
            for bound in torque_bound(robot, motion):
                yield "effort", bound

    def _room(self, motion: JointTrajectory, k: int, orders: int) -> float:
        """How many times faster a stretch could be, but for changes of speed and torques."""
        start, end = self.path.stretches[k].full_speed
        times = np.linspace(start, end, 200)
        factors = [math.inf]
        for order, quantity in enumerate(("velocity", "acceleration", "jerk")[:orders], 1):
            peak = np.abs(motion.polynomial(times, order)).max(axis=0)
            with np.errstate(divide="ignore"):
                factors.append(float((self.space.limits[quantity] / peak).min()) ** (1.0 / order))
        return max(1.0, min(factors))


def check_given_speeds(task: FreeTask) -> None:
    """Refuse tool paths whose given speed takes the tool beyond its limit of speed.

    Raises:
        InputError: There is one.
    """
    scenario, robot = task.scenario, task.space.robot
    limit = scenario.motion_limits.tool_speed
    if limit is None or robot is None:
        return
    from knotwork.verification import tool_speed_bound

    errors = []
    for path in scenario.paths:
        fastest = max(range(len(path.stretches)), key=lambda k: path.stretches[k].speed)
        if path.stretches[fastest].speed <= greatest_path_speed(scenario):
            continue
        row = int(np.abs(task.waypoints.time - path.stretches[0].start).argmin())
        motion = _Search(task, path, [], task.waypoints.position[row]).motion(scenario)
        bound = tool_speed_bound(robot, motion, limit=limit)
        if not _proved(bound):
            errors.append(path_error(scenario, path, fastest, "takes the tool beyond"))
    if errors:
        raise together(errors)


def _proved(bound: Bound) -> bool:
    """Whether a limit is kept, if there is one."""
    return bound.limit is None or (bound.proved and bound.bound <= bound.limit)


def _rounded(speed: float) -> float:
    """A speed rounded down to a few digits."""
    step = 10.0 ** (math.floor(math.log10(speed)) - DIGITS + 1)
    return float(f"{math.floor(speed / step * (1.0 + 1e-12)) * step:.{DIGITS}g}")
