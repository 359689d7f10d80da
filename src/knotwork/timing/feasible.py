"""What can't be solved, said before the solver runs: where, by which joint, and what would do."""

from __future__ import annotations

import numpy as np

from knotwork.errors import TimingError
from knotwork.joint_quantities import rate_unit
from knotwork.least_durations import feasible_durations
from knotwork.timing.bounds import least_durations
from knotwork.timing.problem import TimingProblem
from knotwork.timing.safe_numbers import rounded_down, rounded_up

ROUNDING = 1e-12
"""A given value may be beyond a limit by this part of it."""


def check_feasible(problem: TimingProblem) -> None:
    """Compare what is given with the limits.

    Raises:
        TimingError: A given value is beyond a limit, a given duration is too short, or a duration
            has no least value.
    """
    _check_limits(problem)
    _check_values(problem)
    _check_stopping(problem)
    _check_durations(problem)


def _check_limits(problem: TimingProblem) -> None:
    """Every joint must be limited, or durations would shrink to nothing."""
    limits = problem.limits
    unlimited = np.isinf(limits.acceleration) & np.isinf(limits.jerk) & np.isinf(limits.effort)
    if problem.objective.time and problem.free.any() and unlimited.any():
        joints = [problem.joint_names[k] for k in np.flatnonzero(unlimited)]
        raise TimingError(
            f"joint {', '.join(map(repr, joints))}: no limit of acceleration, jerk or effort, so "
            "there is no least time; give one",
            joint=joints[0],
            limit="acceleration",
        )


def _check_values(problem: TimingProblem) -> None:
    limits, text = problem.limits, problem.units.text
    for name, values in (("velocity", problem.velocity), ("acceleration", problem.acceleration)):
        most = getattr(limits, name)
        known = problem.velocity_known if name == "velocity" else problem.acceleration_known
        over = known[:, None] & (np.abs(values) > most * (1.0 + ROUNDING))
        for i, k in np.argwhere(over)[:1]:
            unit = rate_unit(problem.joint_units[k], 1 if name == "velocity" else 2)
            moving = values[i] != 0.0
            factor = float((most[moving] / np.abs(values[i, moving])).min())
            raise TimingError(
                f"waypoint {problem.names[i]!r}: joint {problem.joint_names[k]!r} is given a "
                f"{name} of {text(values[i, k], unit)}; its limit is {text(most[k], unit)}. "
                f"{rounded_down(factor, 4):.4g} times the {name} given here would be possible",
                waypoint=int(i),
                joint=problem.joint_names[k],
                limit=name,
                value=float(values[i, k]),
                bound=float(np.copysign(most[k], values[i, k])),
            )
    slack = ROUNDING * np.maximum(1.0, np.abs(problem.position))
    outside = (problem.position < limits.lower - slack) | (problem.position > limits.upper + slack)
    for i, k in np.argwhere(outside)[:1]:
        unit = problem.joint_units[k]
        near = float(np.clip(problem.position[i, k], limits.lower[k], limits.upper[k]))
        raise TimingError(
            f"waypoint {problem.names[i]!r}: joint {problem.joint_names[k]!r} stands at "
            f"{text(problem.position[i, k], unit)}, outside its limits "
            f"{text(limits.lower[k], unit)} to {text(limits.upper[k], unit)}",
            waypoint=int(i),
            joint=problem.joint_names[k],
            limit="position",
            value=float(problem.position[i, k]),
            bound=near,
        )


def _check_stopping(problem: TimingProblem) -> None:
    """A joint that moves towards a limit of its position must be able to stop before it."""
    limits, n, text = problem.limits, len(problem.position), problem.units.text
    with np.errstate(invalid="ignore"):
        for after, points in ((True, range(n - 1)), (False, range(1, n))):
            for i in points:
                v = problem.velocity[i] if after else -problem.velocity[i]
                if not problem.velocity_known[i]:
                    continue
                up, down = limits.upper - problem.position[i], problem.position[i] - limits.lower
                room = np.maximum(np.where(v > 0.0, up, down), 0.0)
                fastest = np.sqrt(2.0 * limits.acceleration * room)
                for k in np.flatnonzero(np.abs(v) > fastest * (1.0 + 1e-9) + 1e-12)[:1]:
                    unit = rate_unit(problem.joint_units[k], 1)
                    most, shown = problem.units.shown(float(fastest[k]), unit)
                    verb = "stop before" if after else "have come from inside"
                    raise TimingError(
                        f"waypoint {problem.names[i]!r}: joint {problem.joint_names[k]!r} moves at "
                        f"{text(problem.velocity[i, k], unit)} and can't {verb} its position "
                        f"limit, {text(room[k], problem.joint_units[k], '.4g')} away; its limit "
                        f"of acceleration allows less than {rounded_down(most):.6g} {shown} there, "
                        "and that of jerk less still",
                        waypoint=int(i),
                        joint=problem.joint_names[k],
                        limit="position",
                        value=float(problem.velocity[i, k]),
                        bound=float(np.copysign(fastest[k], problem.velocity[i, k])),
                    )


def _check_durations(problem: TimingProblem) -> None:
    least = least_durations(problem)
    speeds = np.where(problem.velocity_known[:, None], problem.velocity, 0.0)
    moves = np.abs(np.diff(problem.position, axis=0)) + np.abs(speeds[:-1]) + np.abs(speeds[1:])
    still = moves.max(axis=1) == 0.0
    for i in np.flatnonzero(problem.free & still & (problem.at_least == 0.0))[:1]:
        raise TimingError(
            f"from {problem.names[i]!r} to {problem.names[i + 1]!r} nothing moves, so there is no "
            "least duration; give one, or a lower bound",
            waypoint=int(i),
            interval=True,
            limit="duration",
        )
    for i in np.flatnonzero(~problem.free):
        if problem.duration[i] < least[i] * (1.0 - 1e-9):
            raise GivenDurationError(
                f"from {problem.names[i]!r} to {problem.names[i + 1]!r} {problem.duration[i]:.6g} "
                f"s are given; under the limits it takes more than {rounded_up(least[i]):.6g} s",
                waypoint=int(i),
                interval=True,
                limit="duration",
                value=float(problem.duration[i]),
                bound=float(least[i]),
            )
        _check_blocked(problem, int(i), float(problem.duration[i]))
    shortest = float(
        np.where(problem.free, np.maximum(least, problem.at_least), problem.duration).sum()
    )
    if problem.total is not None and problem.total < shortest * (1.0 - 1e-9):
        raise TimingError(
            f"the motion is to last {problem.total:.6g} s; under the limits it takes more than "
            f"{rounded_up(shortest):.6g} s",
            limit="duration",
            value=problem.total,
            bound=shortest,
        )
    if problem.total is not None and len(problem.position) == 2:
        _check_blocked(problem, 0, problem.total)


class GivenDurationError(TimingError):
    """A given duration that the limits of velocity and acceleration alone rule out."""


def _check_blocked(problem: TimingProblem, i: int, h: float) -> None:
    """A joint that may not stop can't take just any longer duration."""
    if not (problem.velocity_known[i] and problem.velocity_known[i + 1]):
        return
    limits = problem.limits
    _, last, later = feasible_durations(
        problem.position[i + 1] - problem.position[i],
        problem.velocity[i],
        problem.velocity[i + 1],
        limits.velocity,
        limits.acceleration,
    )
    for k in np.flatnonzero((h > last * (1.0 + 1e-9)) & (h < later * (1.0 - 1e-9)))[:1]:
        raise GivenDurationError(
            f"from {problem.names[i]!r} to {problem.names[i + 1]!r} {h:.6g} s are given; with its "
            f"velocities at both ends joint {problem.joint_names[k]!r} takes less than "
            f"{rounded_down(float(last[k])):.6g} s, or, as it must stop and go back, more than "
            f"{rounded_up(float(later[k])):.6g} s",
            waypoint=i,
            interval=True,
            joint=problem.joint_names[k],
            limit="acceleration",
            value=h,
            bound=float(last[k]),
        )
