"""What pictures are made of: motions with their limits, and waypoints with what was asked there."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeAlias

import numpy as np

from knotwork.errors import InputError, UnknownNameError
from knotwork.joint_quantities import DERIVATIVES
from knotwork.joint_space import JointSpace, joint_space
from knotwork.polynomial import PiecewisePolynomial
from knotwork.scenario import Scenario
from knotwork.trajectory import JointTrajectory
from knotwork.verification import Finding, Report
from knotwork.verification.limits import derivative_limits
from knotwork.waypoints import FloatArray, JointWaypoints


class PlanLike(Protocol):
    """What a picture needs of a `knotwork.Plan`."""

    @property
    def scenario(self) -> Scenario:
        """What was asked for."""

    @property
    def space(self) -> JointSpace:
        """The joints and their limits."""

    @property
    def joint_waypoints(self) -> JointWaypoints | None:
        """What was asked for, at the joints, where it is known."""

    @property
    def trajectory(self) -> JointTrajectory:
        """The motion."""

    @property
    def report(self) -> Report:
        """Whether it does what was asked."""


Drawable: TypeAlias = PlanLike | JointTrajectory


@dataclass(frozen=True, eq=False)
class Marks:
    """Waypoints in a picture.

    Attributes:
        time: Times [s], shape (n,).
        names: Names, length n.
        asked: By order of derivative (0, 1) the joint values asked for, shape (n, d), NaN where
            none are.
    """

    time: FloatArray
    names: tuple[str, ...]
    asked: tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Motion:
    """One motion of a picture, all arrays in the order of its own joints.

    Attributes:
        label: What tells it from others in the picture.
        joint_names: Names, length d.
        joint_units: `"rad"` or `"m"` for each.
        curve: Joint positions over time, trailing shape (d,).
        curve_in_space: The same, with the joints in the order of the space.
        space: The joints' limits and robot, or `None`.
        marks: The waypoints, or `None`.
        scenario: What was asked for, or `None`.
        ok: What the check said, or `None` if it was not asked.
        uses: Use of each limit given, by joint and quantity.
    """

    label: str
    joint_names: tuple[str, ...]
    joint_units: tuple[str, ...]
    curve: PiecewisePolynomial
    curve_in_space: PiecewisePolynomial
    space: JointSpace | None
    marks: Marks | None
    scenario: Scenario | None
    ok: bool | None
    uses: dict[tuple[str, str], Finding]

    def bounds(self, joint: str, quantity: str) -> tuple[float, float]:
        """Lower and upper limit of a quantity of a joint, infinite where none is given."""
        if self.space is None:
            return -np.inf, np.inf
        i = self.space.joint_names.index(joint)
        lower, upper = self.space.bounds(quantity)
        return float(lower[i]), float(upper[i])


def motions_of(
    given: Drawable | Sequence[Drawable],
    *,
    scenario: Scenario | None = None,
    space: JointSpace | None = None,
    labels: Sequence[str] | None = None,
) -> list[Motion]:
    """Collect the motions of a picture.

    Raises:
        InputError: There is none, one is neither plan nor trajectory, they are not of the same
            joints, or the labels do not fit.
    """
    things: list[Any] = list(given) if isinstance(given, Sequence) else [given]
    if not things:
        raise InputError("a picture needs at least one plan or trajectory")
    if scenario is not None and space is None:
        space = joint_space(scenario)
    motions = [_motion(thing, scenario, space) for thing in things]
    first = motions[0]
    for motion in motions[1:]:
        if set(motion.joint_names) != set(first.joint_names):
            raise InputError(
                f"motions in one picture must be of the same joints; one is of "
                f"{', '.join(first.joint_names)}, another of {', '.join(motion.joint_names)}"
            )
        if dict(zip(motion.joint_names, motion.joint_units, strict=True)) != dict(
            zip(first.joint_names, first.joint_units, strict=True)
        ):
            raise InputError("motions in one picture must give their joints in the same units")
    names = _distinct([motion.label for motion in motions]) if labels is None else list(labels)
    if len(names) != len(motions) or len(set(names)) != len(names):
        raise InputError(f"labels are {names}; give one for each of {len(motions)} motions")
    return [replace(motion, label=name) for motion, name in zip(motions, names, strict=True)]


def _distinct(labels: list[str]) -> list[str]:
    """Number labels that occur twice."""
    return [
        f"{label} ({labels[: i + 1].count(label)})" if labels.count(label) > 1 else label
        for i, label in enumerate(labels)
    ]


def _motion(thing: Any, scenario: Scenario | None, space: JointSpace | None) -> Motion:
    ok: bool | None = None
    marks: Marks | None = None
    if isinstance(thing, JointTrajectory):
        trajectory = thing
    elif isinstance(getattr(thing, "trajectory", None), JointTrajectory):
        trajectory, scenario, space = thing.trajectory, thing.scenario, thing.space
        ok = bool(thing.report.ok)
        if thing.joint_waypoints is not None:
            marks = _marks_of_plan(thing.joint_waypoints, trajectory)
    else:
        raise InputError(f"can't draw {type(thing).__name__}; give a Plan or a JointTrajectory")
    names, units = trajectory.joint_names, trajectory.joint_units
    found: Iterable[Finding] = thing.report.findings if thing is not trajectory else ()
    ordered = trajectory
    if space is not None:
        ordered = trajectory.reordered(space.joint_names, space.joint_units)
        found = found or derivative_limits(space, ordered.polynomial)
    uses = {
        (one.name, one.quantity): one
        for one in found
        if one.subject == "joint" and one.quantity in DERIVATIVES and one.limit is not None
    }
    if marks is None and scenario is not None and space is not None:
        marks = _marks_of_scenario(scenario, space, trajectory)
    if marks is None and trajectory.waypoint_times is not None:
        times = np.asarray(trajectory.waypoint_times)
        nothing = np.full((len(times), len(names)), np.nan)
        marks = Marks(times, tuple(map(str, range(len(times)))), (nothing, nothing))
    label = trajectory.planner or "trajectory"
    return Motion(
        label,
        names,
        units,
        trajectory.polynomial,
        ordered.polynomial,
        space,
        marks,
        scenario,
        ok,
        uses,
    )


def _marks_of_plan(waypoints: JointWaypoints, trajectory: JointTrajectory) -> Marks:
    order = [waypoints.joint_names.index(name) for name in trajectory.joint_names]
    asked = waypoints.position[:, order], waypoints.velocity[:, order]
    return Marks(waypoints.time, waypoints.names, asked)


def _marks_of_scenario(scenario: Scenario, space: JointSpace, trajectory: JointTrajectory) -> Marks:
    """Waypoints of a scenario; joint values only of those that are given by joint values."""
    shape = (len(scenario.waypoints), len(space.joint_names))
    position, velocity = np.full(shape, np.nan), np.full(shape, np.nan)
    for i, state in enumerate(space.targets):
        if state is not None:
            position[i], velocity[i] = state.position, state.velocity
    order = [space.joint_names.index(name) for name in trajectory.joint_names]
    names = tuple(waypoint.name for waypoint in scenario.waypoints)
    return Marks(scenario.times, names, (position[:, order], velocity[:, order]))


def chosen(kind: str, given: Sequence[str] | None, available: Sequence[str]) -> list[str]:
    """Names chosen among those available, all by default, each once.

    Raises:
        UnknownNameError: One is not available.
        InputError: None is chosen.
    """
    names = list(dict.fromkeys(available if given is None else given))
    for name in names:
        if name not in available:
            raise UnknownNameError(kind, name, available)
    if not names:
        raise InputError(f"no {kind} is chosen; accepted: {', '.join(available)}")
    return names


def chosen_quantities(given: Sequence[str] | None) -> list[str]:
    """Quantities chosen; see `chosen`."""
    return chosen("quantity", given, DERIVATIVES)
