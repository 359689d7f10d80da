"""`TimingProblem`: waypoints and limits of a motion with unknown durations."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.arrays import (
    BoolArray,
    FloatArray,
    ReadOnlyArrays,
    check_known_rows,
    checked_joints,
    checked_rows,
    known_rows,
    number_array,
)
from knotwork.errors import ArrayError, InputError, WaypointDataError
from knotwork.errors.arguments import require_number
from knotwork.errors.old_names import OldAttribute
from knotwork.errors.plain_text import quoted_waypoint
from knotwork.joint_quantities import JointLimits
from knotwork.planning.timing.feasible_durations import FeasibleDurations, feasible_durations
from knotwork.units import SI, Units

if TYPE_CHECKING:
    from knotwork.planning.timing.symbolic_dynamics import Dynamics

_NOT_GIVEN: Any = None

_WAYPOINT_FIELDS = ("position", "velocity", "acceleration", "names", "is_direction", "max_factor")


@dataclass(frozen=True)
class Objective:
    """Objective of durations and curve: a weighted sum.

    The integrals run over the whole motion and are sums over the joints.

    Attributes:
        time: Weight of the total duration [1/s].
        jerk: Weight of the integral of jerk squared [s⁵/rad²].
        acceleration: Weight of the integral of acceleration squared [s³/rad²].
        effort: Weight of the integral of effort squared [1/(N² m² s)]. Needs dynamics.

    Raises:
        InputError: A weight is negative or not finite, or all are zero.

    >>> Objective().time, Objective(time=0, jerk=1).jerk
    (1.0, 1.0)
    """

    time: float = 1.0
    jerk: float = 0.0
    acceleration: float = 0.0
    effort: float = 0.0

    def __post_init__(self) -> None:
        names = [term.name for term in fields(self)]
        for name in names:
            value = require_number(getattr(self, name), f"weight of {name}", minimum=0.0)
            object.__setattr__(self, name, value)
        if not any(getattr(self, name) for name in names):
            raise InputError("all weights of the objective are zero; give one that is positive")

    @property
    def only_time(self) -> bool:
        """Whether the duration is the only term."""
        return not any(getattr(self, term.name) for term in fields(self) if term.name != "time")


@dataclass(frozen=True, eq=False)
class TimingProblem(ReadOnlyArrays):
    """Waypoints with unknown durations and possibly velocities, and the limits.

    The motion has five cubic pieces between two waypoints, and is C2.

    Attributes:
        joint_names: Names of the joints, length d.
        position: Joint positions at the waypoints [rad or m], shape (n, d), n >= 2.
        velocity: Joint velocities [rad/s or m/s], shape (n, d); a row of NaN where they are
            unknown.
        limits: The limits; those of effort need dynamics.
        names: Names of the waypoints, length n; by default their indices.
        joint_units: `"rad"` or `"m"` for each joint; by default all `"rad"`.
        is_direction: Whether each row of `velocity` is a direction with an unknown factor >= 0,
            shape (n,); by default false.
        max_factor: Upper bound of that factor, shape (n,); by default infinite.
        acceleration: Joint accelerations at the waypoints [rad/s² or m/s²], shape (n, d); a row of
            NaN where they are unknown, the default.
        duration: Durations between waypoints [s], shape (n-1,); NaN where unknown, the default.
        min_duration: Lower bound of an unknown duration [s], shape (n-1,); by default 0.
        total: Sum of the durations [s], or `None`.
        tool_speed: Speed limit of the tool centre point [m/s], by default infinite; needs dynamics.
        objective: The objective; by default the time.
        dynamics: Dynamics of the robot, for limits of effort and of tool speed.
        units: Units of errors; by default SI.

    Raises:
        ArrayError: Shapes do not match, or a value is impossible; for values at waypoints a
            `WaypointDataError`.
        InputError: Dynamics are missing, or are of other joints.

    >>> from knotwork.joint_quantities import JointLimits
    >>> problem = TimingProblem(("a",), [[0], [1]], [[0], [0]], JointLimits([1.0], [2.0]))
    >>> problem.duration_is_unknown, problem.names
    (array([ True]), ('0', '1'))
    """

    joint_names: tuple[str, ...]
    position: FloatArray
    velocity: FloatArray
    limits: JointLimits
    names: tuple[str, ...] = field(default=(), kw_only=True)
    joint_units: tuple[str, ...] = field(default=(), kw_only=True)
    is_direction: BoolArray = field(default=_NOT_GIVEN, kw_only=True)
    max_factor: FloatArray = field(default=_NOT_GIVEN, kw_only=True)
    acceleration: FloatArray = field(default=_NOT_GIVEN, kw_only=True)
    duration: FloatArray = field(default=_NOT_GIVEN, kw_only=True)
    min_duration: FloatArray = field(default=_NOT_GIVEN, kw_only=True)
    total: float | None = field(default=None, kw_only=True)
    tool_speed: float = field(default=np.inf, kw_only=True)
    objective: Objective = field(default_factory=Objective, kw_only=True)
    dynamics: Dynamics | None = field(default=None, kw_only=True)
    units: Units = field(default=SI, kw_only=True)

    def __post_init__(self) -> None:
        def put(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        names, units = checked_joints(self.joint_names, self.joint_units)
        put("joint_names", names)
        put("joint_units", units)
        n, d = len(self.position), len(names)
        if n < 2:
            raise WaypointDataError(f"a motion needs at least two waypoints, not {n}")
        put("names", tuple(self.names) or tuple(str(i) for i in range(n)))
        if len(self.names) != n:
            raise WaypointDataError(f"names must have length {n}, not {len(self.names)}")
        put("position", checked_rows(self.position, (n, d), "position"))
        put("velocity", checked_rows(self.velocity, (n, d), "velocity", unknown=True))
        for name, shape, default in (
            ("acceleration", (n, d), np.nan),
            ("is_direction", (n,), False),
            ("max_factor", (n,), np.inf),
            ("duration", (n - 1,), np.nan),
            ("min_duration", (n - 1,), 0.0),
        ):
            given = getattr(self, name)
            values = np.full(shape, default) if given is None else given
            put(name, number_array(values, shape, name, type(default)))
        put("tool_speed", float(number_array(self.tool_speed, (), "tool speed limit")))
        if not self.tool_speed > 0.0:
            raise ArrayError(f"tool speed limit is {self.tool_speed}; give a positive one")
        if self.limits.velocity.shape != (d,):
            raise ArrayError(
                f"limits are given for {self.limits.velocity.size} joints; there are {d}"
            )
        self._check_dynamics()
        for name in ("velocity", "acceleration"):
            check_known_rows(getattr(self, name), self.names, name)
        self._check_times()

    def _check_dynamics(self) -> None:
        limits = self.limits
        needed = np.isfinite(limits.effort).any() or np.isfinite(self.tool_speed)
        if self.dynamics is None and (needed or self.objective.effort):
            raise InputError(
                "limits of effort or tool speed, and an objective with effort, need dynamics"
            )
        if self.dynamics is not None and self.dynamics.robot.dof != len(self.joint_names):
            raise InputError(
                f"the dynamics are of {self.dynamics.robot.dof} joints; "
                f"there are {len(self.joint_names)}"
            )

    def _check_times(self) -> None:
        wrong = np.flatnonzero((self.duration <= 0.0) | np.isinf(self.duration))
        if wrong.size:
            i = int(wrong[0])
            raise WaypointDataError(
                f"the duration from {quoted_waypoint(self.names[i])} to "
                f"{quoted_waypoint(self.names[i + 1])} is {self.duration[i]:g} s; give a positive "
                "and finite number, or NaN to have it chosen",
                waypoint_index=i,
                value=float(self.duration[i]),
            )
        if not (self.min_duration >= 0.0).all() or not np.isfinite(self.min_duration).all():
            raise WaypointDataError("min_duration must be finite and not negative [s]")
        if not (self.max_factor >= 0.0).all():
            raise WaypointDataError("max_factor must not be negative")
        if self.total is not None:
            total = require_number(self.total, "total", "s", positive=True)
            object.__setattr__(self, "total", total)
        lost = self.is_direction & ~known_rows(self.velocity)
        if lost.any():
            i = int(np.argmax(lost))
            raise WaypointDataError(f"{self.names[i]!r} has no direction along which to move")

    at_least = OldAttribute("min_duration")
    free = OldAttribute("duration_is_unknown")

    @property
    def required_dynamics(self) -> Dynamics:
        """The dynamics, which must be given."""
        if self.dynamics is None:
            raise TypeError("the problem has no dynamics")
        return self.dynamics

    def limit(self, name: str) -> FloatArray:
        """Limits of effort, shape (d,), or of tool speed, shape (1,)."""
        return np.array([self.tool_speed]) if name == "tool_speed" else self.limits[name]

    def feasible_durations(self, i: int) -> FeasibleDurations:
        """Feasible durations of each joint for an interval."""
        return feasible_durations(
            self.position[i + 1] - self.position[i],
            self.velocity[i],
            self.velocity[i + 1],
            self.limits.velocity,
            self.limits.acceleration,
        )

    @property
    def duration_is_unknown(self) -> BoolArray:
        """Whether each duration is unknown, shape (n-1,)."""
        return np.isnan(self.duration)

    @property
    def velocity_known(self) -> BoolArray:
        """Whether the velocity at each waypoint is given, shape (n,)."""
        return ~self.is_direction & known_rows(self.velocity)

    @property
    def acceleration_known(self) -> BoolArray:
        """Whether the acceleration at each waypoint is given, shape (n,)."""
        return known_rows(self.acceleration)

    def with_state(self, i: int, velocity: FloatArray, acceleration: FloatArray) -> TimingProblem:
        """The problem with a known velocity and acceleration at a waypoint, shape (d,) each."""
        known = {"velocity": velocity, "acceleration": acceleration, "is_direction": False}
        arrays: dict[str, Any] = {name: np.array(getattr(self, name)) for name in known}
        for name, values in known.items():
            arrays[name][i] = values
        return replace(self, **arrays)

    def between(self, first: int, last: int) -> TimingProblem:
        """The problem from one waypoint to another."""
        rows = dict.fromkeys(("duration", "min_duration"), slice(first, last))
        rows |= dict.fromkeys(_WAYPOINT_FIELDS, slice(first, last + 1))
        return replace(self, **{name: getattr(self, name)[kept] for name, kept in rows.items()})
