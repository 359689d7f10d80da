"""`JointTrajectory`: a motion of named joints as a piecewise polynomial in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, ReadOnlyArrays, checked_joints, checked_rows, checked_times
from knotwork.curves.polynomial import Extrema, PiecewisePolynomial
from knotwork.curves.polynomial.jumps import measure_jumps
from knotwork.curves.polynomial.two_point import two_point_coefficients
from knotwork.curves.trajectory.exportable import Exportable
from knotwork.curves.trajectory.motion_events import Event, Load, Segment
from knotwork.curves.trajectory.sampling import MAX_SAMPLES, Knots, Samples, make_sample_times
from knotwork.errors import InputError, UnknownNameError
from knotwork.errors.old_names import OldAttribute
from knotwork.joint_quantities import MOTION_QUANTITIES


@dataclass(frozen=True)
class Jump:
    """The largest jump of one quantity at the inner breaks of a trajectory, as measured.

    Attributes:
        jump: Absolute value, in the unit of the joint.
        joint: Name of the joint; `None` if there is no inner break.
        time: Time of the break [s]; `None` if there is none.
        relative: The largest ratio of a joint's jump to that joint's own peak absolute value. Jumps
            that rounding of the coefficients explains are left out. Thus noise about zero, as in
            the acceleration of a straight motion, does not count.
    """

    jump: float
    joint: str | None
    time: float | None
    relative: float


@dataclass(frozen=True)
class Continuity:
    """Smoothness of a trajectory at its breaks, measured from its polynomials.

    Attributes:
        position, velocity, acceleration: The largest jumps.
        order: The largest k such that the derivatives 0 … k of every joint jump by less than 1e-9
            relative to their peak: 2 for a C2 curve, -1 if the position jumps. A curve without any
            jump has its degree as order.
    """

    position: Jump
    velocity: Jump
    acceleration: Jump
    order: int


@dataclass(frozen=True, eq=False)
class JointTrajectory(ReadOnlyArrays, Exportable):
    """Motion of named joints over time. Its smoothness depends on its planner; see `continuity`.

    It is only defined on [start_time, end_time], and not even one rounding outside.

    >>> curve = JointTrajectory.from_knots(["elbow"], [0, 2], [[0], [1]], [[0], [0]])
    >>> curve.position(1.0), curve.velocity([0.0, 1.0]).shape
    (array([0.5]), (2, 1))
    >>> curve.extrema("velocity").peak
    array([0.75])

    Attributes:
        joint_names: Names of the joints, length d.
        polynomial: Joint positions [rad or m] over time [s], trailing shape (d,).
        joint_units: `"rad"` or `"m"` for each joint; by default all `"rad"`.
        origin: Source of the motion: its planner, or its file and interpolation; or empty.
        waypoint_times: Times of its waypoints [s], or `None`.
        events: Switching events, in order of time.
        loads: Loads of the arm, in order of time; empty if unknown.
        segments: Segments of the motion, in order of time; empty if unknown.

    Raises:
        InputError: The number of components is not the number of joints, a name occurs twice, a
            unit is unknown, or a waypoint time is outside the trajectory.
    """

    joint_names: tuple[str, ...]
    polynomial: PiecewisePolynomial
    joint_units: tuple[str, ...] = field(default=(), kw_only=True)
    origin: str = field(default="", kw_only=True)
    waypoint_times: FloatArray | None = field(default=None, kw_only=True)
    events: tuple[Event, ...] = field(default=(), kw_only=True)
    loads: tuple[Load, ...] = field(default=(), kw_only=True)
    segments: tuple[Segment, ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        names, units = checked_joints(self.joint_names, self.joint_units)
        if self.polynomial.axis != 0 or self.polynomial.c.shape[2:] != (len(names),):
            raise InputError(
                f"{len(names)} joints need a polynomial with trailing shape ({len(names)},) and "
                f"time axis 0, not {self.polynomial.c.shape[2:]} and axis {self.polynomial.axis}"
            )
        object.__setattr__(self, "joint_names", names)
        object.__setattr__(self, "joint_units", units)
        if self.waypoint_times is not None:
            times = checked_times(self.waypoint_times)
            if times[0] < self.start_time or times[-1] > self.end_time:
                raise InputError(
                    f"waypoint times run from {times[0]:.17g} s to {times[-1]:.17g} s; the "
                    f"trajectory is defined from {self.start_time:.17g} s to {self.end_time:.17g} s"
                )
            object.__setattr__(self, "waypoint_times", times)

    planner = OldAttribute("origin")

    @classmethod
    def from_knots(
        cls,
        joint_names: Sequence[str],
        time: ArrayLike,
        position: ArrayLike,
        velocity: ArrayLike,
        *,
        joint_units: Sequence[str] | None = None,
        origin: str = "",
        waypoint_times: ArrayLike | None = None,
    ) -> JointTrajectory:
        """Join positions and velocities by cubic Hermite pieces (C1; C2 if the data are).

        This reproduces any trajectory of degree three or less, C1 or smoother, from its `knots`.

        Args:
            joint_names: Names of the joints, length d.
            time: Times of the breaks [s], shape (m,), strictly increasing.
            position: Positions at the breaks [rad or m], shape (m, d).
            velocity: Velocities at the breaks [rad/s or m/s], shape (m, d).
            joint_units: `"rad"` or `"m"` for each joint; by default all `"rad"`.
            origin: Source of the motion, for example the name of its planner.
            waypoint_times: Times of the waypoints [s].

        Raises:
            WaypointDataError: Times do not increase, shapes do not match, values are not finite.
        """
        t = checked_times(time, subject="knot")
        shape = (t.size, len(joint_names))
        r = checked_rows(position, shape, "position")
        v = checked_rows(velocity, shape, "velocity")
        return cls(
            tuple(joint_names),
            PiecewisePolynomial(two_point_coefficients(t, (r, v)), t),
            joint_units=tuple(joint_units or ()),
            origin=origin,
            waypoint_times=None if waypoint_times is None else checked_times(waypoint_times),
        )

    def reordered(
        self,
        joint_names: Sequence[str],
        joint_units: Sequence[str] | None = None,
        *,
        owner: str = "the scenario",
    ) -> JointTrajectory:
        """Return the motion with its joints in another order.

        Args:
            joint_names: The joints in the new order, length d.
            joint_units: The required unit of each joint; by default any.
            owner: Owner of the joints, for the error.

        Raises:
            InputError: The trajectory has other joints, or gives one in another unit.

        >>> still = [[0, 0], [0, 0]]
        >>> motion = JointTrajectory.from_knots(["a", "b"], [0, 1], [[0, 0], [1, 2]], still)
        >>> motion.reordered(["b", "a"]).position(1.0)
        array([2., 1.])
        """
        wanted = tuple(joint_names)
        missing = [name for name in wanted if name not in self.joint_names]
        extra = [name for name in self.joint_names if name not in wanted]
        if missing or extra:
            faults = [f"lacks joint {', '.join(missing)}"] if missing else []
            faults += [f"has joint {', '.join(extra)}"] if extra else []
            raise InputError(
                f"the trajectory {' and '.join(faults)}; the joints of {owner} are "
                f"{', '.join(wanted)}"
            )
        order = [self.joint_names.index(name) for name in wanted]
        units = tuple(self.joint_units[i] for i in order)
        for name, stated, unit in zip(wanted, units, joint_units or units, strict=True):
            if stated != unit:
                raise InputError(
                    f"the trajectory gives joint {name!r} in {stated}; {owner} has it in {unit}"
                )
        if wanted == self.joint_names:
            return self
        polynomial = PiecewisePolynomial(self.polynomial.c[:, :, order], self.breaks)
        return replace(self, joint_names=wanted, polynomial=polynomial, joint_units=units)

    @property
    def start_time(self) -> float:
        """First time at which the trajectory is defined [s]."""
        return float(self.polynomial.x[0])

    @property
    def end_time(self) -> float:
        """Last time at which the trajectory is defined [s]."""
        return float(self.polynomial.x[-1])

    @property
    def duration(self) -> float:
        """End time minus start time [s]."""
        return self.end_time - self.start_time

    @property
    def breaks(self) -> FloatArray:
        """Breaks between the polynomials, including both ends [s], shape (m,)."""
        return self.polynomial.x

    def __call__(self, t: ArrayLike, nu: int = 0) -> FloatArray:
        """Evaluate the nu-th derivative of the joint positions.

        At a break the piece after it counts, and at the end time the last piece.

        Args:
            t: Times [s], any shape.
            nu: Order of the derivative, >= 0.

        Returns:
            Values, shape of `t` followed by (d,).

        Raises:
            TimeRangeError: A time is NaN, before the start or after the end, even by one rounding.
            InputError: `nu` is not an integer, or negative.
        """
        return self.polynomial(t, nu)

    def position(self, t: ArrayLike) -> FloatArray:
        """Joint positions [rad or m] at times t [s]; raises as calling does.

        >>> motion = JointTrajectory.from_knots(["a"], [0, 1], [[0], [1]], [[0], [0]])
        >>> motion.position(0.5), motion.position([0.0, 0.5, 1.0]).shape
        (array([0.5]), (3, 1))
        """
        return self.polynomial(t, 0)

    def velocity(self, t: ArrayLike) -> FloatArray:
        """Joint velocities [rad/s or m/s] at times t [s]; raises as calling does."""
        return self.polynomial(t, 1)

    def acceleration(self, t: ArrayLike) -> FloatArray:
        """Joint accelerations [rad/s² or m/s²] at times t [s]; raises as calling does."""
        return self.polynomial(t, 2)

    def jerk(self, t: ArrayLike) -> FloatArray:
        """Joint jerks [rad/s³ or m/s³] at times t [s]; raises as calling does.

        At a break, where the jerk of a cubic spline jumps, it has the value of the next piece. At
        the end time it has the value of the last piece.
        """
        return self.polynomial(t, 3)

    def sample(self, rate: float, *, max_samples: int = MAX_SAMPLES) -> Samples:
        """Sample the trajectory at a fixed rate, including its start and its end.

        Samples are at intervals of 1/rate from the start on. The last one is exactly at the end
        time, so the last step may be shorter, but not shorter than a millionth of a period.

        Args:
            rate: Samples per second [Hz].
            max_samples: Maximum number of samples.

        Raises:
            InputError: The rate is not positive and finite, gives too many samples, or a period
                below the resolution of the times.

        >>> motion = JointTrajectory.from_knots(["a"], [0, 1], [[0], [1]], [[0], [0]])
        >>> samples = motion.sample(rate=4)
        >>> samples.time, samples.velocity.shape
        (array([0.  , 0.25, 0.5 , 0.75, 1.  ]), (5, 1))
        """
        time = make_sample_times(self.start_time, self.end_time, rate, max_samples)
        return Samples(time, *(self.polynomial(time, nu) for nu in range(4)))

    def extrema(self, quantity: int | str = 0) -> Extrema:
        """Find the exact minimum and maximum of a quantity for every joint.

        Extrema are those of the polynomials, not of samples; at breaks both sides count.

        Args:
            quantity: `"position"`, `"velocity"`, `"acceleration"`, `"jerk"`, or the order of the
                derivative.

        Returns:
            Values in the joints' units and their times [s], shape (d,) each.

        Raises:
            UnknownNameError: No quantity has that name.
            InputError: The order is not an integer, or negative.

        >>> motion = JointTrajectory.from_knots(["a"], [0, 1], [[0], [1]], [[0], [0]])
        >>> fastest = motion.extrema("velocity")
        >>> fastest.maximum, fastest.maximum_time
        (array([1.5]), array([0.5]))
        """
        if isinstance(quantity, str):
            if quantity not in MOTION_QUANTITIES:
                raise UnknownNameError("quantity", quantity, MOTION_QUANTITIES)
            return self.polynomial.extrema(MOTION_QUANTITIES.index(quantity))
        return self.polynomial.extrema(quantity)

    @property
    def knots(self) -> Knots:
        """Positions, velocities and accelerations at the breaks."""
        t = self.breaks
        return Knots(t, *(self.polynomial(t, nu) for nu in range(3)))

    @cached_property
    def continuity(self) -> Continuity:
        """Measured jumps of position, velocity and acceleration at the inner breaks."""
        degree = self.polynomial.degree
        jumps = [self._largest_jump(nu) for nu in range(max(3, degree + 1))]
        broken = [nu for nu, jump in enumerate(jumps) if jump.relative > 0.0]
        order = broken[0] - 1 if broken else degree
        return Continuity(jumps[0], jumps[1], jumps[2], order)

    def _largest_jump(self, nu: int) -> Jump:
        sizes, allowed = measure_jumps(self.polynomial, nu)
        if not sizes.size:
            return Jump(0.0, None, None, 0.0)
        counted = np.where(sizes > allowed, sizes, 0.0)
        peak = self.polynomial.extrema(nu).peak
        relative = np.divide(counted, peak, out=np.zeros_like(counted), where=counted > 0.0)
        knot, joint = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
        return Jump(
            float(sizes[knot, joint]),
            self.joint_names[joint],
            float(self.breaks[knot + 1]),
            float(relative.max()),
        )
