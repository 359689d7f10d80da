"""Lossless export: points that define a motion exactly, or within a tolerance.

A receiver interpolates positions and velocities by cubics, and with accelerations by quintics. If
the motion has such pieces, the receiver reproduces it exactly. Otherwise it makes another curve,
and the difference follows from the polynomials.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.extrema import locate_extremum_candidates
from knotwork.curves.polynomial.splitting import split_at
from knotwork.curves.polynomial.two_point import raise_degree, two_point_coefficients
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import ExportError, InputError
from knotwork.errors.arguments import require_flag, require_number
from knotwork.joint_quantities import MOTION_QUANTITIES, rate_unit

LOSSLESS = 1e-12
"""Error of the curve below which points are lossless, relative to the largest term of the motion's
polynomials: about a hundred times the rounding error.
"""

MAX_EXPORTED_POINTS = 1_000_000
"""Maximum number of points. No controller accepts more in one message."""

MAX_CUTS = 64
"""Maximum number of parts into which a piece is divided in one round."""

PIECE_NAMES = {2: "cubics", 3: "quintics"}
"""Polynomials between points, by the number of quantities of a point."""
POINT_CONTENTS = {2: "position and velocity", 3: "position, velocity and acceleration"}
"""Quantities of a point, by their number."""


@dataclass(frozen=True, eq=False)
class MotionPoints:
    """A motion as points, from which a receiver rebuilds it (C1; C2 with accelerations).

    Attributes:
        trajectory: The curve that the receiver computes: its knots are the points.
        with_acceleration: Whether the points have accelerations. Then the pieces are quintics.
        exact: Whether the curve is the motion itself up to rounding.
        error: Largest error [rad or m], over all joints and all time.
        velocity_error: Largest velocity error [rad/s or m/s].
        acceleration_error: Largest acceleration error [rad/s² or m/s²].
        inserted: Number of points between the knots of the motion.
    """

    trajectory: JointTrajectory
    with_acceleration: bool
    exact: bool
    error: float
    velocity_error: float
    acceleration_error: float
    inserted: int

    @property
    def count(self) -> int:
        """Number of points."""
        return int(self.trajectory.breaks.size)

    def describe(self) -> str:
        """Describe the number of points, and the accuracy of the curve through them."""
        points = f"{self.count} points of {POINT_CONTENTS[3 if self.with_acceleration else 2]}"
        if self.exact:
            return f"{points} define the whole motion exactly"
        return (
            f"{points}, {self.inserted} of them inserted; off by at most "
            f"{self.error:.3g} in position [rad or m], {self.velocity_error:.3g} in velocity "
            f"[per s] and {self.acceleration_error:.3g} in acceleration [per s^2]; "
            f"{'C2' if self.with_acceleration else 'C1: the acceleration jumps'}"
        )


def motion_points(
    motion: JointTrajectory | MotionPoints,
    *,
    accelerations: bool = False,
    tolerance: float | None = None,
) -> MotionPoints:
    """Take the knots of a motion, or as many points as define it within a tolerance.

    Points are inserted only where the error of the cubics (or quintics) through the knots exceeds
    the tolerance. The error is the maximum of the difference of the polynomials, from its critical
    points and not from samples.

    >>> import knotwork as kw
    >>> quintic = kw.plan("paper_case", planner="quintic").trajectory
    >>> motion_points(quintic, accelerations=True).exact
    True
    >>> motion_points(quintic, tolerance=1e-4).count > quintic.breaks.size
    True

    Args:
        motion: The motion, or points of it, which are returned unchanged.
        accelerations: Include accelerations, so that receivers use quintics.
        tolerance: Tolerance of the result [rad or m]; by default it must be exact.

    Raises:
        ExportError: The knots alone do not define the motion and no tolerance is given. Or no
            number of points defines it, because a quantity in them jumps.
        InputError: The tolerance is not positive, or takes more than a million points; or points
            are given together with other options.
    """
    accelerations = require_flag(accelerations, "accelerations")
    if isinstance(motion, MotionPoints):
        if motion.with_acceleration != accelerations or tolerance is not None:
            raise InputError("these points have their options already; give the trajectory")
        return motion
    quantities = 3 if accelerations else 2
    if tolerance is not None:
        tolerance = require_number(tolerance, "tolerance", "rad or m", positive=True)
    received = _receive(motion, motion.breaks, quantities)
    exact = bool((largest_difference(motion, received) <= LOSSLESS * _scale(motion)).all())
    if not exact:
        _refuse_jumps(motion, quantities, tolerance)
        if tolerance is None:
            raise _lossy(motion, quantities, received)
        received = receive_within(motion, quantities, tolerance)
    errors = [float(largest_difference(motion, received, nu).max()) for nu in range(3)]
    curve = motion if exact else replace(motion, polynomial=received)
    inserted = int(received.x.size - motion.breaks.size)
    return MotionPoints(curve, accelerations, exact, errors[0], errors[1], errors[2], inserted)


def _receive(motion: JointTrajectory, times: FloatArray, quantities: int) -> PiecewisePolynomial:
    """The curve of a receiver from points of 1 quantity (lines), 2 (cubics) or 3 (quintics)."""
    derivatives = tuple(motion(times, nu) for nu in range(quantities))
    return PiecewisePolynomial(two_point_coefficients(times, derivatives), times)


def largest_difference(
    trajectory: JointTrajectory, received: PiecewisePolynomial, nu: int = 0
) -> FloatArray:
    """Largest absolute difference of the nu-th derivative on each piece, shape (pieces, d).

    Args:
        trajectory: The motion.
        received: The curve of a receiver; the breaks of the motion are among its breaks.
        nu: Order of the derivative: 0 for the position.
    """
    pieces = split_at(trajectory.polynomial, received.x).c
    degree = max(len(pieces), len(received.c)) - 1
    difference = raise_degree(pieces, degree) - raise_degree(received.c, degree)
    off = PiecewisePolynomial(difference, received.x).derivative(nu)
    return np.asarray(np.abs(locate_extremum_candidates(off.x, off.c)[0]).max(axis=0))


def _divide_evenly(times: FloatArray, parts: FloatArray) -> FloatArray:
    """Divide each interval into a number of equal parts.

    Args:
        times: Ends of the intervals [s], shape (n + 1,).
        parts: Numbers of parts, shape (n,), whole but possibly beyond any integer.

    Returns:
        Ends of the parts [s], shape (sum of parts + 1,).

    Raises:
        InputError: There are more than a million parts.
    """
    if parts.sum() >= MAX_EXPORTED_POINTS:
        raise InputError(
            f"this tolerance takes more than {MAX_EXPORTED_POINTS} points; give a larger one"
        )
    counts = parts.astype(int)
    index = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    step = np.repeat(np.diff(times) / counts, counts)
    return np.append(np.repeat(times[:-1], counts) + index * step, times[-1])


def _scale(trajectory: JointTrajectory) -> FloatArray:
    """Largest term of each joint's polynomials [rad or m], shape (d,)."""
    c = trajectory.polynomial.c
    powers = np.arange(len(c) - 1, -1, -1.0)[:, None, None]
    return np.asarray(np.abs(c * np.diff(trajectory.breaks)[:, None] ** powers).max(axis=(0, 1)))


def _refuse_jumps(trajectory: JointTrajectory, quantities: int, tolerance: float | None) -> None:
    """Refuse a motion with a jump of a quantity of which each point has only one value."""
    smooth = trajectory.continuity
    if smooth.order >= quantities - 1:
        return
    quantity = MOTION_QUANTITIES[smooth.order + 1]
    jump = getattr(smooth, quantity)
    unit = trajectory.joint_units[trajectory.joint_names.index(jump.joint)]
    unit = rate_unit(unit, smooth.order + 1)
    raise ExportError(
        f"points of {POINT_CONTENTS[quantities]} can't define this motion"
        f"{'' if tolerance is None else ', however many there are'}: the {quantity} of joint "
        f"{jump.joint!r} jumps by {jump.jump:.3g} {unit} at {jump.time:.9g} s, and a point holds "
        "one value of it; choose another planner, or leave accelerations out",
        joint=jump.joint,
        error=jump.jump,
        time=jump.time,
    )


def _lossy(
    trajectory: JointTrajectory, quantities: int, received: PiecewisePolynomial
) -> ExportError:
    """Make the error for a motion that its knots do not define."""
    times = trajectory.breaks
    off = largest_difference(trajectory, received)
    piece, joint = (int(i) for i in np.unravel_index(int(off.argmax()), off.shape))
    degree = trajectory.polynomial.degree
    name, unit = trajectory.joint_names[joint], trajectory.joint_units[joint]
    motion = f"the motion from {trajectory.origin}" if trajectory.origin else "this motion"
    return ExportError(
        f"{motion} has polynomials of degree {degree}; {PIECE_NAMES[quantities]} through the "
        f"{POINT_CONTENTS[quantities]} of its {times.size} knots would be off by up to "
        f"{off[piece, joint]:.3g} {unit} (joint {name!r}, between {times[piece]:.6g} s and "
        f"{times[piece + 1]:.6g} s): choose a planner of cubics; or give a "
        "tolerance in rad or m (--tolerance); or, where the format has them and the planner makes "
        "quintics, send accelerations too, by accelerations=True (--accelerations)",
        joint=name,
        error=float(off[piece, joint]),
        time=float(times[piece]),
    )


def receive_within(
    trajectory: JointTrajectory, quantities: int, tolerance: float
) -> PiecewisePolynomial:
    """Divide the pieces of a motion until the curve of a receiver is within a tolerance.

    The error of a piece decreases with the power 2·quantities of its length, which gives the number
    of parts. The error of the parts is then measured.

    Args:
        trajectory: The motion.
        quantities: Number of quantities of a point: 1 for positions, 2 with velocities, 3 with
            accelerations.
        tolerance: Tolerance [rad or m].

    Raises:
        InputError: The tolerance takes more than a million points.
    """
    received = _receive(trajectory, trajectory.breaks, quantities)
    while True:
        worst = largest_difference(trajectory, received).max(axis=1)
        if (worst <= tolerance).all():
            return received
        needed = np.clip(np.ceil((worst / tolerance) ** (0.5 / quantities)), 2, MAX_CUTS)
        parts = np.where(worst > tolerance, needed, 1)
        received = _receive(trajectory, _divide_evenly(received.x, parts), quantities)
