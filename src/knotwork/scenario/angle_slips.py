"""Angles of a file that are plausibly given in the wrong unit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, NamedTuple

import numpy as np

from knotwork.scenario.scenario import Scenario
from knotwork.task.si_units import numbers

WHOLE_TURN = 2.0 * np.pi * 1.001
"""Angles above this [rad], a whole turn plus rounding, are probably degrees."""
FAST_TURN = 2.0 * WHOLE_TURN
"""Rates above this [rad/s], two turns a second, are probably degrees: few joints are as fast."""
FRACTION_TOLERANCE = 0.002
"""Tolerance of a simple fraction of a turn in radians [rad]: 3.14, 1.57."""


_TURNS = ("angle", "angle or length")
_RATES = ("angle/s", "angle/s or length/s")
_Kind = Literal["joint angle", "angle of a pose", "rate"]


class _Angle(NamedTuple):
    where: str
    value: float
    kind: _Kind


def angle_slips(scenario: Scenario, units: Mapping[str, str]) -> list[str]:
    """List angles that are plausibly degrees in a file in radians, or radians in one in degrees.

    Args:
        scenario: The task.
        units: SI unit of each joint by name.
    """
    angles = list(_angles(scenario, units))
    if scenario.units.angle == "rad":
        bounds = {"rate": (FAST_TURN, "rad/s, more than two turns a second")}
        angle = (WHOLE_TURN, "rad, more than a whole turn")
        return [
            f"{slip.where} is {slip.value:g} {words}; if it is in degrees, give "
            "`units: {angle: deg}`"
            for slip in angles
            for bound, words in [bounds.get(slip.kind, angle)]
            if abs(slip.value) > bound
        ]
    slips = []
    for kind in ("joint angle", "angle of a pose"):
        alike = [angle for angle in angles if angle.kind == kind]
        if _plausibly_radians(alike):
            largest = max(alike, key=lambda angle: abs(angle.value))
            slips.append(
                f"{largest.where} is {largest.value:g} degrees, the largest {kind} of the file"
                "; if they are in radians, give `units: {angle: rad}`"
            )
    return slips


def _plausibly_radians(angles: list[_Angle]) -> bool:
    """Whether none exceeds a turn, and one is a multiple of its eighth or twelfth."""
    values = np.array([abs(angle.value) for angle in angles if angle.value])
    if not values.size or values.max() > WHOLE_TURN:
        return False
    times = np.round(values / [[np.pi / 4], [np.pi / 6]])
    parts = times * [[np.pi / 4], [np.pi / 6]]
    return bool(((times > 0) & (np.abs(values - parts) <= FRACTION_TOLERANCE)).any())


def _angles(scenario: Scenario, units: Mapping[str, str]) -> Iterator[_Angle]:
    for location, unit, value in numbers(scenario.task, (*_TURNS, *_RATES)):
        turning = units.get(str(location[-1])) == "rad"
        where = scenario.where(*location)
        if unit in _RATES:
            of_all = location == ("limits", "velocity") and "rad" in units.values()
            if of_all or ((turning or unit == "angle/s") and "velocity" in location[1:3]):
                yield _Angle(where, value, "rate")
        elif location[0] == "start" or location[2:3] == ("joints",):
            if turning:
                yield _Angle(where, value, "joint angle")
        elif unit == "angle" and location[0] != "tolerances":
            yield _Angle(where, value, "angle of a pose")
