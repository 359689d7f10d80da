"""Infeasible values at waypoints: beyond the limits, and efforts at rest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from knotwork.errors import TimingError
from knotwork.joint_quantities import JOINT_QUANTITIES, rate_unit
from knotwork.timing.problem import BoolArray, TimingProblem

ROUNDING = 1e-12
"""A given value may be beyond a limit by this part of it."""

DIGITS = 4
"""Digits of a factor that an error names."""

SPARE = 1e-4
"""A duration that is named is longer than one that suffices by this part of it."""

STILL = "stop here, or move the waypoint or the limit"
"""Remedy where a joint is at its position limit and moves."""


def overloads(problem: TimingProblem, *, certain: bool) -> list[TimingError]:
    """Say which joints can't hold the arm still, and at which waypoint it takes most effort.

    Args:
        problem: The task.
        certain: Whether only what proves that there is no motion is an error: where the
            acceleration is chosen the arm may pass while it falls, and else it may not stop.
    """
    rests = (problem.velocity == 0.0).all(axis=1)
    known = rests & (problem.acceleration == 0.0).all(axis=1)
    heavy = _heavy(problem, known if certain else rests | ~problem.velocity_known)
    if not heavy:
        return []
    limits, unit = problem.limits, JOINT_QUANTITIES["effort"].units

    def text(effort: float, k: int) -> str:
        return problem.units.text(effort / limits.margin, unit[problem.joint_units[k]])

    messages = [
        f"{'to rest ' if not rests[i] else ''}at {problem.names[i]!r} joint "
        f"{problem.joint_names[k]!r} needs a limit of effort above {text(rounded_up(effort), k)}; "
        f"it is {text(float(limits.effort[k]), k)}"
        for i, k, effort in heavy
    ]
    what = "no motion keeps all limits" if certain else "no motion was found that keeps all limits"
    i, k, effort = heavy[0]
    return [
        TimingError(
            f"{what}: {'; and '.join(messages)}{limits.margin_note}",
            waypoint=i,
            joint=problem.joint_names[k],
            limit="effort",
            value=float(limits.effort[k]),
            bound=effort,
        )
    ]


def _heavy(problem: TimingProblem, waypoints: BoolArray) -> list[tuple[int, int, float]]:
    """Waypoint, joint and effort [N m or N] where that is most, of joints that can't hold still."""
    limit, rows = problem.limits.effort, np.flatnonzero(waypoints)
    if not np.isfinite(limit).any() or not rows.size:
        return []
    q = problem.position[rows]
    effort = np.abs(problem.arm.effort(q, np.zeros_like(q), np.zeros_like(q)))
    over = np.flatnonzero((effort > limit * (1.0 + ROUNDING)).any(axis=0)).tolist()
    place = effort.argmax(axis=0)
    return [(int(rows[place[k]]), k, float(effort[place[k], k])) for k in over]


@dataclass(frozen=True)
class Fault:
    """A value at a waypoint that a limit of one joint makes infeasible.

    Attributes:
        waypoint: Index of the waypoint.
        joint: Index of the joint.
        given: `"velocity"`, `"acceleration"` or `"position"`.
        limit: The limit that rules it out: one of these, too.
        value: The value given, in SI.
        bound: What the limit leaves of it, in SI.
        text: The fault, in words.
    """

    waypoint: int
    joint: int
    given: str
    limit: str
    value: float
    bound: float
    text: str

    @property
    def factor(self) -> float:
        """Greatest feasible part of the value given."""
        return self.bound / self.value

    def error(self, problem: TimingProblem) -> TimingError:
        """The error, with the greatest feasible part."""
        advice = ""
        if self.given != "position" and not self.bound:
            advice = f". No part of the {self.given} given here is possible: {STILL}"
        elif self.given != "position":
            factor = rounded_down(self.factor, DIGITS)
            advice = f". At most {factor:g} times the {self.given} given here is possible"
        name, joint = problem.names[self.waypoint], problem.joint_names[self.joint]
        return TimingError(
            f"waypoint {name!r}: joint {joint!r} {self.text}{advice}",
            waypoint=self.waypoint,
            joint=joint,
            limit=self.limit,
            value=self.value,
            bound=self.bound,
        )


def faults(problem: TimingProblem) -> list[Fault]:
    """Values beyond limits: at each waypoint the worst of each quantity."""
    found: dict[tuple[int, str], Fault] = {}
    for one in (*_beyond(problem), *_unstoppable(problem)):
        place = one.waypoint, one.given
        if place not in found or (one.given != "position" and one.factor < found[place].factor):
            found[place] = one
    return sorted(found.values(), key=lambda one: one.waypoint)


def _beyond(problem: TimingProblem) -> Iterator[Fault]:
    """Values that are themselves beyond a limit."""
    limits, text, q = problem.limits, problem.units.text, problem.position
    for name, order, article, known in (
        ("velocity", 1, "a", problem.velocity_known),
        ("acceleration", 2, "an", problem.acceleration_known),
    ):
        most, values = getattr(limits, name), getattr(problem, name)
        for i, k in np.argwhere(known[:, None] & (np.abs(values) > most * (1.0 + ROUNDING))):
            value, unit = float(values[i, k]), rate_unit(problem.joint_units[k], order)
            message = (
                f"is given {article} {name} of {text(value, unit)}; "
                f"its limit is {limits.text(float(most[k]), unit, problem.units)}"
            )
            bound = math.copysign(float(most[k]), value)
            yield Fault(int(i), int(k), name, name, value, bound, message)
    slack = ROUNDING * np.maximum(1.0, np.abs(q))
    for i, k in np.argwhere((q < limits.lower - slack) | (q > limits.upper + slack)):
        unit, value = problem.joint_units[k], float(q[i, k])
        lower, upper = float(limits.lower[k]), float(limits.upper[k])
        message = (
            f"stands at {text(value, unit)}, outside its limits "
            f"{text(lower, unit)} to {text(upper, unit)}"
        )
        bound = min(max(value, lower), upper)
        yield Fault(int(i), int(k), "position", "position", value, bound, message)


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
                most = np.sqrt(2.0 * limits.acceleration * room)
            for k in np.flatnonzero(np.abs(v) > most * (1.0 + 1e-9) + 1e-12):
                kind, value = problem.joint_units[k], float(problem.velocity[i, k])
                verb = "stop before" if after else "have come from inside"
                needed = float(0.5 * v[k] ** 2 / limits.acceleration[k])
                message = (
                    f"moves at {text(value, rate_unit(kind, 1))} and can't {verb} its position "
                    f"limit, {text(float(room[k]), kind, '.4g')} away; it needs at least "
                    f"{text(needed, kind, '.4g')}"
                )
                bound = math.copysign(float(most[k]), value)
                yield Fault(i, int(k), "velocity", "position", value, bound, message)


def rounded_up(value: float, digits: int = 6) -> float:
    """Round a number up to n digits.

    >>> rounded_up(1.3833333), rounded_up(2.0)
    (1.38334, 2.0)
    """
    return -rounded_down(-value, digits)


def rounded_down(value: float, digits: int = 6) -> float:
    """Round a number down to n digits.

    >>> rounded_down(1.3833333, 3), rounded_down(0.0)
    (1.38, 0.0)
    """
    if not value or not math.isfinite(value):
        return value
    places = digits - 1 - math.floor(math.log10(abs(value)))
    near = round(value, places)
    if abs(near - value) <= ROUNDING * abs(value):
        return near
    return round(math.floor(value * 10.0**places) / 10.0**places, places)


def with_room(value: float) -> float:
    """A duration a little above one that was found, in few digits: it is possible, too.

    >>> with_room(1.3833333)
    1.384
    """
    return rounded_up(value * (1.0 + SPARE), 4)
