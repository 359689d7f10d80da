"""What can't be solved, said before the solver runs: where, by which joint, and what would do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from knotwork.errors import TimingError
from knotwork.joint_quantities import rate_unit
from knotwork.timing.bounds import least_durations, slowest
from knotwork.timing.problem import TimingProblem
from knotwork.timing.safe_numbers import rounded_down, rounded_up

ROUNDING = 1e-12
"""A given value may be beyond a limit by this part of it."""


AT_LIMIT = 1e-4
"""A joint is at a limit of its position if it has less than this part of the room it needs."""


def unfit_durations(problem: TimingProblem) -> list[TimingError]:
    """Compare durations with the limits of velocity and acceleration; for values see `faults`.

    Returns:
        An error for each duration that is too short, or has no least value.
    """
    return list(_unlimited(problem)) or list(_unfit(problem))


def _unlimited(problem: TimingProblem) -> Iterator[TimingError]:
    """Every joint must be limited, or durations would shrink to nothing."""
    limits = problem.limits
    unlimited = np.isinf(limits.acceleration) & np.isinf(limits.jerk) & np.isinf(limits.effort)
    if problem.objective.time and problem.free.any() and unlimited.any():
        joints = [problem.joint_names[k] for k in np.flatnonzero(unlimited)]
        yield TimingError(
            f"joint {', '.join(map(repr, joints))}: no limit of acceleration, jerk or effort, so "
            "there is no least time; give one",
            joint=joints[0],
            limit="acceleration",
        )


@dataclass(frozen=True)
class Fault:
    """What is given at a waypoint and is ruled out by a limit of one joint.

    Attributes:
        waypoint: Index of the waypoint.
        joint: Index of the joint.
        given: `"velocity"`, `"acceleration"` or `"position"`.
        limit: The limit that rules it out: one of these, too.
        value: What is given, in SI.
        bound: The limit that it is beyond, or what the limit leaves of it, in SI.
        said: What is wrong, in words.
    """

    waypoint: int
    joint: int
    given: str
    limit: str
    value: float
    bound: float
    said: str

    @property
    def factor(self) -> float:
        """More than this part of what is given is not possible."""
        return self.bound / self.value


def faults(problem: TimingProblem) -> list[Fault]:
    """Find what is given beyond a limit: at each waypoint of each quantity what is worst."""
    found: dict[tuple[int, str], Fault] = {}
    for one in (*_beyond(problem), *_unstoppable(problem)):
        place = one.waypoint, one.given
        if place not in found or (one.given != "position" and one.factor < found[place].factor):
            found[place] = one
    return sorted(found.values(), key=lambda one: one.waypoint)


def _beyond(problem: TimingProblem) -> Iterator[Fault]:
    """Values that are themselves beyond a limit."""
    limits, text = problem.limits, problem.units.text
    for name, values in (("velocity", problem.velocity), ("acceleration", problem.acceleration)):
        most = getattr(limits, name)
        known = problem.velocity_known if name == "velocity" else problem.acceleration_known
        for i, k in np.argwhere(known[:, None] & (np.abs(values) > most * (1.0 + ROUNDING))):
            order, article = (1, "a") if name == "velocity" else (2, "an")
            unit = rate_unit(problem.joint_units[k], order)
            said = (
                f"is given {article} {name} of {text(values[i, k], unit)}; "
                f"its limit is {limits.text(float(most[k]), unit, problem.units)}"
            )
            bound = float(np.copysign(most[k], values[i, k]))
            yield _fault(problem, int(i), int(k), (name, name), bound, said)
    slack = ROUNDING * np.maximum(1.0, np.abs(problem.position))
    outside = (problem.position < limits.lower - slack) | (problem.position > limits.upper + slack)
    for i, k in np.argwhere(outside):
        unit = problem.joint_units[k]
        near = float(np.clip(problem.position[i, k], limits.lower[k], limits.upper[k]))
        said = (
            f"stands at {text(problem.position[i, k], unit)}, outside its limits "
            f"{text(limits.lower[k], unit)} to {text(limits.upper[k], unit)}"
        )
        yield _fault(problem, int(i), int(k), ("position", "position"), near, said)


def _unstoppable(problem: TimingProblem) -> Iterator[Fault]:
    """Joints that move towards a limit of their position and can't stop before it."""
    limits, n, text = problem.limits, len(problem.position), problem.units.text
    for after, points in ((True, range(n - 1)), (False, range(1, n))):
        for i in points:
            v = problem.velocity[i] if after else -problem.velocity[i]
            if not problem.velocity_known[i]:
                continue
            up, down = limits.upper - problem.position[i], problem.position[i] - limits.lower
            room = np.maximum(np.where(v > 0.0, up, down), 0.0)
            with np.errstate(invalid="ignore"):
                fastest = np.sqrt(2.0 * limits.acceleration * room)
            for k in np.flatnonzero(np.abs(v) > fastest * (1.0 + 1e-9) + 1e-12):
                kind = problem.joint_units[k]
                speed = text(problem.velocity[i, k], rate_unit(kind, 1))
                needed, most = 0.5 * v[k] ** 2 / limits.acceleration[k], fastest[k]
                if room[k] < AT_LIMIT * needed:
                    most = 0.0
                    said = (
                        f"is at its position limit, and moves at {speed}; it needs more than "
                        f"{text(needed, kind, '.3g')} of room beyond it"
                    )
                else:
                    verb = "stop before" if after else "have come from inside"
                    said = (
                        f"moves at {speed} and can't {verb} its position limit, "
                        f"{text(room[k], kind, '.4g')} away"
                    )
                bound = float(np.copysign(most, problem.velocity[i, k]))
                yield _fault(problem, i, int(k), ("velocity", "position"), bound, said)


def _fault(
    problem: TimingProblem, i: int, k: int, kinds: tuple[str, str], bound: float, said: str
) -> Fault:
    value = float(getattr(problem, kinds[0])[i, k])
    said = f"waypoint {problem.names[i]!r}: joint {problem.joint_names[k]!r} {said}"
    return Fault(i, k, *kinds, value, bound, said)


def _unfit(problem: TimingProblem) -> Iterator[TimingError]:
    least = least_durations(problem)
    speeds = np.where(problem.velocity_known[:, None], problem.velocity, 0.0)
    moves = np.abs(np.diff(problem.position, axis=0)) + np.abs(speeds[:-1]) + np.abs(speeds[1:])
    still = moves.max(axis=1) == 0.0
    for i in np.flatnonzero(problem.free & still & (problem.at_least == 0.0)):
        yield TimingError(
            f"from {problem.names[i]!r} to {problem.names[i + 1]!r} nothing moves, so there is no "
            "least duration; give one, or a lower bound",
            waypoint=int(i),
            interval=True,
            limit="duration",
        )
    for i in np.flatnonzero(~problem.free):
        if problem.duration[i] < least[i] * (1.0 - 1e-9):
            what = slowest(problem, int(i))
            yield GivenDurationError(
                f"from {problem.names[i]!r} to {problem.names[i + 1]!r} {problem.duration[i]:.6g} "
                f"s are given; under the limits of velocity and acceleration {what} "
                f"takes more than {rounded_up(least[i]):.6g} s",
                waypoint=int(i),
                interval=True,
                limit="duration",
                value=float(problem.duration[i]),
                bound=float(least[i]),
            )
        else:
            yield from _blocked(problem, int(i), float(problem.duration[i]))
    shortest = float(
        np.where(problem.free, np.maximum(least, problem.at_least), problem.duration).sum()
    )
    if problem.total is not None and problem.total < shortest * (1.0 - 1e-9):
        yield TimingError(
            f"the motion is to last {problem.total:.6g} s; under the limits it takes more than "
            f"{rounded_up(shortest):.6g} s",
            limit="duration",
            value=problem.total,
            bound=shortest,
        )
    elif problem.total is not None and len(problem.position) == 2:
        yield from _blocked(problem, 0, problem.total)


class GivenDurationError(TimingError):
    """A given duration that the limits of velocity and acceleration alone rule out."""


def _blocked(problem: TimingProblem, i: int, h: float) -> Iterator[TimingError]:
    """A joint that may not stop can't take just any longer duration."""
    if not (problem.velocity_known[i] and problem.velocity_known[i + 1]):
        return
    _, last, later = problem.possible_durations(i)
    for k in np.flatnonzero((h > last * (1.0 + 1e-9)) & (h < later * (1.0 - 1e-9)))[:1]:
        yield GivenDurationError(
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
