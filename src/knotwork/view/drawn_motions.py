"""Content of pictures: motions with their limits, and waypoints with their given values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeAlias

import numpy as np

from knotwork.errors import InputError, UnknownNameError
from knotwork.joint_quantities import DERIVATIVES, MAGNITUDES
from knotwork.polynomial import PiecewisePolynomial
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace, JointState, joint_space
from knotwork.task import PlainTask
from knotwork.trajectory import JointTrajectory
from knotwork.units import Units
from knotwork.verification import Finding, Report
from knotwork.verification.brief import worst_short_text
from knotwork.verification.finding import unite_intervals
from knotwork.verification.limits import LIMITS, derivative_limits
from knotwork.view.clearance_curve import nearest_around
from knotwork.view.style import DASHES
from knotwork.waypoints import FloatArray, JointWaypoints


class PlanLike(Protocol):
    """The part of a `knotwork.Plan` that a picture needs."""

    @property
    def scenario(self) -> Scenario:
        """The task."""

    @property
    def space(self) -> JointSpace:
        """The joints and their limits."""

    @property
    def joint_waypoints(self) -> JointWaypoints | None:
        """Joint values given at the waypoints, where known."""

    @property
    def trajectory(self) -> JointTrajectory:
        """The motion."""

    @property
    def report(self) -> Report:
        """Result of the check."""


Drawable: TypeAlias = PlanLike | JointTrajectory


@dataclass(frozen=True, eq=False)
class Marks:
    """Waypoints of the scenario in a picture, without inserted ones along tool paths.

    Attributes:
        time: Times [s], shape (n,).
        names: Names, length n.
        asked: Given joint values by order of derivative (0, 1), shape (n, d), NaN for
            missing ones, and for velocities that planning chose.
    """

    time: FloatArray
    names: tuple[str, ...]
    asked: tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Motion:
    """One motion of a picture, its joints in the order of the space if there is one.

    Attributes:
        label: Its name in the picture.
        trajectory: The motion.
        space: The joints' limits and robot, or `None`.
        marks: The waypoints, or `None`.
        scenario: The task, or `None`.
        ok: Whether the check passes, or `None` without a check.
        reason: Reason of the failure, in one line, or empty.
        uses: Use of each limit given, by joint and quantity.
        judged: Findings of the check on limits of tool and links.
        knots: Breaks of the motion [s].
        contacts: Time intervals of contacts [s].
    """

    label: str
    trajectory: JointTrajectory
    space: JointSpace
    marks: Marks | None
    scenario: Scenario
    ok: bool | None
    uses: dict[tuple[str, str], Finding]
    judged: tuple[Finding, ...]
    knots: FloatArray
    contacts: tuple[tuple[float, float], ...] = ()
    reason: str = ""

    @property
    def curve(self) -> PiecewisePolynomial:
        """Joint positions over time."""
        return self.trajectory.polynomial

    def units(self, degrees: bool | None) -> Units:
        """Units of the scenario, with the given unit of angles, if any."""
        own = self.scenario.units
        return own if degrees is None else replace(own, angle="deg" if degrees else "rad")

    def bounds(self, joint: str, quantity: str) -> tuple[float, float]:
        """Lower and upper limit of a quantity of a joint, infinite without a limit."""
        i = self.space.joint_names.index(joint)
        lower, upper = self.space.bounds(quantity)
        return float(lower[i]), float(upper[i])


def motions_of(
    given: Drawable | Sequence[Drawable],
    *,
    scenario: Scenario | None = None,
    labels: Sequence[str] | None = None,
) -> list[Motion]:
    """Collect the motions of a picture.

    Raises:
        InputError: There are none, one is neither plan nor trajectory, their joints differ,
            or the labels do not fit.
    """
    things: list[Any] = list(given) if isinstance(given, Sequence) else [given]
    if not things:
        raise InputError("a picture needs at least one plan or trajectory")
    space = joint_space(scenario) if scenario is not None else None
    motions = [_motion(thing, scenario, space) for thing in things]
    first = motions[0].trajectory
    for motion in motions[1:]:  # raises for other joints
        owner = "the first motion of the picture"
        motion.trajectory.reordered(first.joint_names, first.joint_units, owner=owner)
    names = _distinct([motion.label for motion in motions]) if labels is None else list(labels)
    if len(names) != len(motions) or len(set(names)) != len(names):
        raise InputError(f"labels are {names}; give one for each of {len(motions)} motions")
    return [replace(motion, label=name) for motion, name in zip(motions, names, strict=True)]


def check_distinct(motions: Sequence[Motion]) -> None:
    """Refuse more motions in one panel than there are line styles.

    Raises:
        InputError: There are too many.
    """
    if len(motions) > len(DASHES):
        raise InputError(
            f"{len(motions)} motions are too many for one picture; choose at most {len(DASHES)}"
        )


def limit_uses(found: Iterable[Finding]) -> dict[tuple[str, str], Finding]:
    """Use of the limits of joints, by joint and quantity."""
    return {
        (one.name, one.quantity): one
        for one in found
        if one.subject == "joint" and one.quantity in DERIVATIVES and one.limit is not None
    }


def _distinct(labels: list[str]) -> list[str]:
    """Number labels that occur twice."""
    return [
        f"{label} ({labels[: i + 1].count(label)})" if labels.count(label) > 1 else label
        for i, label in enumerate(labels)
    ]


def _motion(thing: Any, scenario: Scenario | None, space: JointSpace | None) -> Motion:
    plan = None if isinstance(thing, JointTrajectory) else thing
    trajectory = getattr(plan, "trajectory", None) if plan is not None else thing
    if not isinstance(trajectory, JointTrajectory):
        raise InputError(f"can't draw {type(thing).__name__}; give a Plan or a JointTrajectory")
    found: Sequence[Finding] = ()
    if plan is not None:
        scenario, space, found = plan.scenario, plan.space, plan.report.findings
    elif scenario is None or space is None:
        scenario, space = asking_nothing(""), _unlimited(trajectory)
    trajectory = trajectory.reordered(space.joint_names, space.joint_units)
    found = found or tuple(derivative_limits(space, trajectory.polynomial))
    marks = _marks(trajectory, scenario, space, plan.joint_waypoints if plan else None)
    label = trajectory.planner or "trajectory"
    ok = bool(plan.report.ok) if plan else None
    uses, knots = limit_uses(found), trajectory.polynomial.x
    judged = tuple(one for one in found if one.group in LIMITS and one.subject != "joint")
    nearest = nearest_around(found)
    if nearest is not None:
        judged += (nearest,)
    contacts = tuple(
        unite_intervals(at for one in found if one.bodies and not one.ok for at in one.spans)
    )
    reason = worst_short_text(plan.report.failures, plan.scenario.units) if plan else ""
    return Motion(
        *(label, trajectory, space, marks, scenario, ok),
        *(uses, judged, knots, contacts),
        reason=reason,
    )


def chosen_velocities(scenario: Scenario) -> set[str]:
    """Names of waypoints whose velocity planning chose, so that it was not given."""
    return {name for run in scenario.task.chosen or () for name in run.velocities}


def asking_nothing(name: str) -> Scenario:
    """A task for a motion without one."""
    return Scenario(name, (), PlainTask.model_construct(waypoints=()))


def _unlimited(motion: JointTrajectory) -> JointSpace:
    """The joints of a motion without known limits."""
    endless = np.full(len(motion.joint_names), np.inf)
    limits = dict.fromkeys(MAGNITUDES, endless)
    return JointSpace(motion.joint_names, motion.joint_units, -endless, endless, limits)


def _marks(
    trajectory: JointTrajectory,
    scenario: Scenario,
    space: JointSpace,
    waypoints: JointWaypoints | None,
) -> Marks | None:
    """Waypoints as far as known: without a plan no joint values of poses."""
    if waypoints is not None:
        order = [waypoints.joint_names.index(name) for name in trajectory.joint_names]
        own = list(waypoints.asked)
        names = [waypoints.names[i] for i in own]
        chosen_there = np.isin(names, list(chosen_velocities(scenario)))[:, np.newaxis]
        velocity = np.where(chosen_there, np.nan, waypoints.velocity[own][:, order])
        asked = waypoints.position[own][:, order], velocity
        for i in space.waits:
            names[i + 1] = ""  # a wait has one name, at its start
        return Marks(waypoints.time[own], tuple(names), asked)
    nothing = np.full(len(trajectory.joint_names), np.nan)
    if scenario.waypoints:
        states = [target or JointState(nothing, nothing) for target in space.targets]
        position = np.array([state.position for state in states])
        velocity = np.array([state.velocity for state in states])
        given = tuple(waypoint.name for waypoint in scenario.waypoints)
        return Marks(scenario.times, given, (position, velocity))
    if trajectory.waypoint_times is None:
        return None
    times = np.asarray(trajectory.waypoint_times)
    unknown = np.tile(nothing, (len(times), 1))
    return Marks(times, tuple(map(str, range(len(times)))), (unknown, unknown))


def chosen(kind: str, given: Sequence[str] | None, available: Sequence[str]) -> list[str]:
    """Names chosen among the available ones, by default all, each once.

    Raises:
        UnknownNameError: A name is not available.
        InputError: No name is chosen.
    """
    names = list(dict.fromkeys(available if given is None else given))
    for name in names:
        if name not in available:
            raise UnknownNameError(kind, name, available)
    if not names:
        raise InputError(f"no {kind} is chosen; accepted: {', '.join(available)}")
    return names


def chosen_quantities(given: Sequence[str] | None) -> list[str]:
    """Chosen quantities; see `chosen`."""
    return chosen("quantity", given, DERIVATIVES)
