"""The greatest constant speed along each tool path that gives none.

The joints' motion along the path is made as it will be planned, and its exact peaks are compared
with the limits, as are the speeds of joints that follow the path itself. The speed is found by
bisection.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from knotwork.choosing.task import FreeTask, knots_of
from knotwork.choosing.tool_speeds import ROUNDING, greatest_path_speed, located, path_error, tell
from knotwork.documents import REMOVED, Location
from knotwork.errors import DocumentError, InputError, PathError
from knotwork.interpolation import ModifiedHermiteSpline
from knotwork.joint_quantities import DERIVATIVES, JOINT_QUANTITIES
from knotwork.scenario import Scenario, ScenarioPath
from knotwork.scenario.free_times import PROVISIONAL_SPEED
from knotwork.task_to_joint import followed_path, leads_along
from knotwork.timing import Binding
from knotwork.timing.safe_numbers import with_margin
from knotwork.trajectory import JointTrajectory

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.verification import Bound

Hindrance = tuple[str, str]
"""A joint or a frame, or neither, and the quantity that is limited."""

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


def path_speeds(task: FreeTask) -> tuple[dict[Location, Any], list[Binding]]:
    """The edits that give each stretch its speed, and what bounds these speeds.

    Stretches of one path are slowed down together until the whole path keeps the limits.

    Raises:
        InputError: Nothing bounds a speed, or the limits allow none.
    """
    free = task.free
    edits: dict[Location, Any] = {}
    binding: list[Binding] = []
    for path in task.scenario.paths:
        stretches = [
            k
            for k in range(len(path.stretches))
            if free.index[path.first + 1 + k] in free.path_speed
        ]
        if stretches:
            search = _Search(task, path, stretches)
            speeds = search.speeds()
            edits |= search.edits(speeds)
            binding += search.binding(speeds)
    return edits, binding


class _Search:
    """The search for the speeds of one path."""

    def __init__(self, task: FreeTask, path: ScenarioPath, stretches: list[int]) -> None:
        scenario, free, known = task.scenario, task.free, task.waypoints
        self.task, self.scenario, self.space = task, scenario, task.space
        self.start = known.position[np.abs(known.time - path.stretches[0].start).argmin()]
        self.path, self.stretches = path, stretches
        self.places = [free.index[path.first + 1 + k] for k in stretches]
        most = (1.0 - TOOL_ROOM) * (scenario.motion_limits.tool_speed or math.inf)
        given = [path.stretches[k].speed for k in stretches]
        asked = [free.path_speed.get(*pair) for pair in zip(self.places, given, strict=True)]
        self.caps = [min(speed, most) for speed in asked]
        self.number = scenario.paths.index(path)
        self.unit = scenario.shown_length[0]
        self.hindrance: Hindrance | None = None  # at the speeds that were tried last
        self.too_fast: Hindrance = ("", "velocity")  # why those that failed last did

    def edits(self, speeds: list[float]) -> dict[Location, Any]:
        """The edits for some speeds [m/s]."""
        pairs = zip(self.places, speeds, strict=True)
        edits: dict[Location, Any] = {
            ("waypoints", place, "speed"): _rounded(self.unit * v) for place, v in pairs
        }
        free = self.task.free
        if "times" in free.document.data and not free.duration.any():
            edits[("times",)] = REMOVED  # with these speeds every waypoint has its time
        return edits

    def binding(self, speeds: list[float]) -> list[Binding]:
        """What bounds each of the speeds that were found."""
        names = [waypoint.name for waypoint in self.scenario.waypoints]
        most = self.scenario.motion_limits.tool_speed or math.inf
        found = []
        for k, speed, cap in zip(self.stretches, speeds, self.caps, strict=True):
            held = self.too_fast
            if speed == cap:
                held = "", "at_most" if cap < (1.0 - TOOL_ROOM) * most else "tool speed"
            i = self.path.first + k
            found.append(Binding(names[i], names[i + 1], *held, None))
        return found

    def speeds(self) -> list[float]:
        """The greatest speeds that keep all limits [m/s]."""
        motion = self.motion(self.scenario)
        # at a speed at which the ends exceed a limit, they say nothing of the rest
        orders = 3 if self._exceeded(motion) is None else 1
        rooms = [self._room(motion, k, orders) for k in self.stretches]
        if np.isinf([min(*pair) for pair in zip(rooms, self.caps, strict=True)]).any():
            self._refuse(
                "nothing bounds the speed along it", "speed: {at_most: a speed}, or limits"
            )
        # those that nothing else bounds go at their greatest speeds
        likely = [PROVISIONAL_SPEED * (room if np.isfinite(room) else 1e9) for room in rooms]

        at = partial(self._parts, likely)
        low, high = 0.0, 1.0
        while self._feasible(at(high)):
            low, high = high, 2.0 * high
            if at(low) == self.caps:
                return at(low)
        found = self.below(likely, low, high)
        if found is None:
            self._refuse(self._tried(at(1.0)))
        return found

    def below(self, likely: list[float], low: float = 0.0, high: float = 1.0) -> list[float] | None:
        """The greatest speeds that keep all limits, as parts of likely ones that do not."""
        at = partial(self._parts, likely)
        # a lower speed is not always easier: its changes of speed at the ends are shorter
        slowest = PROVISIONAL_SPEED / max(likely)
        while not low:
            if high <= slowest:
                return None
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

    def _parts(self, likely: list[float], factor: float) -> list[float]:
        pairs = zip(likely, self.caps, strict=True)
        return [min(max(factor * speed, SLOWEST), cap) for speed, cap in pairs]

    def _tried(self, speeds: list[float]) -> str:
        least, most = (f"{self.unit * v:.4g}" for v in (PROVISIONAL_SPEED, max(speeds)))
        if max(speeds) <= PROVISIONAL_SPEED:
            return f"the limits allow less than {least} along it"
        said = f"no speed from {least} to {most} was found at which the limits are kept along it"
        if self.hindrance is None:
            return said
        joint, quantity = self.hindrance
        what = f"{joint!r} exceeds its limit" if joint else "the limit"
        return f"{said}; at {least} {what} of {quantity}{'' if joint else ' is not kept'}"

    def _refuse(self, found: str, accepted: str = "higher limits, or another path") -> NoReturn:
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
            self.hindrance = None
            if not leads_along(scenario, self.space.robot, path, self.start, room=ROOM):
                self.too_fast = "", "velocity"
                return False
            self.hindrance = self._exceeded(self.motion(scenario))
            self.too_fast = self.hindrance or self.too_fast
            return self.hindrance is None
        except (PathError, DocumentError):  # or its tolerances are too fine
            self.too_fast = "", "room for changes of speed"
            return False

    def _exceeded(self, motion: JointTrajectory) -> Hindrance | None:
        """What a motion exceeds; `None` if it keeps every limit."""
        beyond = self.joint_beyond(motion, INSIDE)
        if beyond is not None:
            joint, quantity, _ = beyond
            return self.space.joint_names[joint], quantity
        if self.space.robot is None:
            return None
        bounds = self._bounds(self.space.robot, motion)
        return next((held for held, bound in bounds if not _proved(bound)), None)

    def joint_beyond(self, motion: JointTrajectory, most: float) -> tuple[int, str, float] | None:
        """The joint, its quantity and peak that are beyond that part of a limit, if any is."""
        for quantity in DERIVATIVES[1:]:
            peak = motion.extrema(quantity).peak
            shares = peak / self.space.limits[quantity]
            joint = int(np.argmax(shares))
            if shares[joint] > most:
                return joint, quantity, float(peak[joint])
        return None

    def _bounds(self, robot: Robot, motion: JointTrajectory) -> Iterator[tuple[Hindrance, Bound]]:
        """Proved bounds of what is limited beside the joints' motion, one after another."""
        from knotwork.verification import (
            tool_acceleration_bound,
            tool_speed_bound,
            torque_bound,
        )

        limits = self.scenario.motion_limits
        if limits.tool_speed is not None:
            yield ("", "tool speed"), tool_speed_bound(robot, motion, limit=limits.tool_speed)
        if limits.tool_acceleration is not None:
            most = limits.tool_acceleration
            yield ("", "tool acceleration"), tool_acceleration_bound(robot, motion, limit=most)
        for one in limits.frame_speed:
            bound = tool_speed_bound(robot, motion, frame=one.frame, limit=one.speed)
            yield (one.frame, "speed"), bound
        if np.isfinite(self.space.limits["effort"]).any():
            efforts = torque_bound(robot, motion)
            for joint, bound in zip(self.space.joint_names, efforts, strict=True):
                yield (joint, "effort"), bound

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


def check_joints_at_given_speeds(task: FreeTask, chosen: Container[int]) -> None:
    """Refuse tool paths whose given speeds take a joint beyond a limit.

    Args:
        task: The task.
        chosen: Indices in the file of the ends of stretches whose speed was chosen.

    Raises:
        InputError: There is one.
    """
    scenario, free, space = task.scenario, task.free, task.space
    errors = []
    for path in scenario.paths:
        stretches = list(range(len(path.stretches)))
        places = [("waypoints", free.index[path.first + 1 + k]) for k in stretches]
        if any(
            place[1] in chosen or "speed" not in free.document.data["waypoints"][place[1]]
            for place in places
        ):
            continue
        search = _Search(task, path, stretches)
        beyond = search.joint_beyond(search.motion(scenario), 1.0 + ROUNDING)
        if beyond is None:
            continue
        joint, quantity, peak = beyond
        unit = JOINT_QUANTITIES[quantity].units[space.joint_units[joint]]
        text, limit = scenario.units.text, float(space.limits[quantity][joint])
        said = with_margin(partial(text, unit=unit), limit, scenario.margin)
        names = [waypoint.name for waypoint in scenario.waypoints]
        most = search.below(search.caps)
        shown = ", ".join(scenario.units.text(v, "m/s") for v in search.caps)
        least = ", ".join(f"{_rounded(search.unit * v):g}" for v in most or ())
        accepted = (
            f"{least} {scenario.shown_length[1]}/s, or "
            if most
            else "a lower speed or path.acceleration, or "
        )
        error = InputError(
            f"at {shown} along the path from {names[path.first]!r} to {names[path.last]!r} joint "
            f"{space.joint_names[joint]!r} would reach {text(peak, unit)}; its limit of {quantity} "
            f"is {said}; accepted: {accepted}a higher limit"
        )
        errors.append(located(scenario, error, *places[0], "speed"))
    tell(errors)


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
        motion = _Search(task, path, []).motion(scenario)
        bound = tool_speed_bound(robot, motion, limit=limit)
        if not _proved(bound):
            errors.append(path_error(scenario, path, fastest, "takes the tool beyond"))
    tell(errors)


def _proved(bound: Bound) -> bool:
    """Whether a limit is kept, if there is one."""
    return bound.limit is None or (bound.proved and bound.bound <= bound.limit)


def _rounded(speed: float) -> float:
    """A speed rounded down to a few digits."""
    step = 10.0 ** (math.floor(math.log10(speed)) - DIGITS + 1)
    return float(f"{math.floor(speed / step * (1.0 + 1e-12)) * step:.{DIGITS}g}")
