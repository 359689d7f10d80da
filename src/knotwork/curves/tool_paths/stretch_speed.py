"""The speed at which a stretch of a tool path takes a given time."""

from __future__ import annotations

import math
from collections.abc import Callable

from knotwork.curves.tool_paths.timing_profile import PROFILE_TOLERANCE, checked_end_speed
from knotwork.errors import RampError, StretchTimeError
from knotwork.errors.arguments import require_number


def speed_for_duration(
    length: float,
    duration: float,
    *,
    acceleration: float,
    start_speed: float | None = None,
    end_speed: float | None = None,
) -> float:
    """Find the speed at which a stretch takes a given time, including its ramps.

    Args:
        length: Length of the stretch [m].
        duration: Duration of the stretch [s].
        acceleration: Maximum acceleration along the path where the speed changes [m/s²].
        start_speed: Speed at the start of the stretch [m/s]; by default the stretch's.
        end_speed: Speed at the end of the stretch [m/s]; by default the stretch's.

    Returns:
        The speed [m/s].

    Raises:
        PathError: A value is not positive, or no speed gives this duration; the message has the
            feasible durations.

    >>> speed = kw.tool_paths.speed_for_duration(
    ...     0.1, 2.15, start_speed=0.0, end_speed=0.0, acceleration=0.5)
    >>> round(speed, 12)
    0.05
    """
    acceleration = require_number(acceleration, "acceleration", "m/s²", positive=True)
    length = require_number(length, "length", "m", positive=True)
    duration = require_number(duration, "duration", "s", positive=True)
    end_speeds = [
        checked_end_speed(value, name)
        for name, value in (("start_speed", start_speed), ("end_speed", end_speed))
        if value is not None
    ]

    def time(v: float) -> float:
        ramps = sum((v - p) * abs(v - p) for p in end_speeds)
        return (length + 0.75 * ramps / acceleration) / v

    if not end_speeds:
        return length / duration
    lowest, highest = _find_feasible_speeds(length, end_speeds, acceleration)
    shortest = time(highest)
    longest = time(lowest) if lowest > 0.0 else math.inf
    if not shortest * (1.0 - PROFILE_TOLERANCE) <= duration <= longest * (1.0 + PROFILE_TOLERANCE):
        upper = "" if math.isinf(longest) else f" and at most {longest:.6g} s"
        message = (
            f"{duration:.6g} s are requested for a stretch of {length:.6g} m; with its changes of "
            f"speed at {acceleration:.6g} m/s² it takes at least {shortest:.6g} s{upper}"
        )
        raise StretchTimeError(message, shortest=shortest, longest=longest)
    return _bisect(lambda v: time(v) > duration, lowest, highest)


def _find_feasible_speeds(
    length: float, end_speeds: list[float], acceleration: float
) -> tuple[float, float]:
    """Minimum and maximum speed [m/s] for which ramps to the speeds at its ends fit."""
    squares = [v**2 for v in end_speeds]
    change = 0.75 * abs(squares[0] - squares[-1])
    if change > acceleration * length:
        needed = change / acceleration
        raise RampError(
            f"the stretch is {length:.6g} m long, but to go from {end_speeds[0]:.6g} to "
            f"{end_speeds[1]:.6g} m/s takes {needed:.6g} m",
            length=length,
            needed=needed,
            lowest_acceleration=change / length,
        )
    reach, count = 4.0 * acceleration * length / 3.0, len(end_speeds)
    lowest = math.sqrt(max((sum(squares) - reach) / count, 0.0))
    return lowest, math.sqrt((reach + sum(squares)) / count)


def _bisect(too_slow: Callable[[float], bool], low: float, high: float) -> float:
    """Minimum speed between two that is not too low, to the last digit."""
    while low < (middle := 0.5 * (low + high)) < high:
        if too_slow(middle):
            low = middle
        else:
            high = middle
    return high
