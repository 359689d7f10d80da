"""Angles of a file that are plausibly in another unit than it says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from knotwork.scenario.model import Scenario
from knotwork.task.units import numbers

WHOLE_TURN = 2.0 * np.pi * 1.001
"""Angles above this [rad], a whole turn with what files round, are probably degrees."""
ROUNDED = 0.002
"""A part of a turn in radians may be off by this much [rad]: 3.14, 1.57."""
FEW = 4
"""Joint values that are not zero: fewer say nothing of their unit."""
LEAST_TURN = 1.5
"""If no joint value [rad] is larger, they may well be small angles in degrees."""


class _Angle(NamedTuple):
    where: str
    value: float
    joint: bool


def angle_slips(scenario: Scenario, units: Mapping[str, str]) -> list[str]:
    """Say which angles are plausibly degrees in a file in radians, or radians in one in degrees.

    Args:
        scenario: The task.
        units: SI unit of each joint by name.
    """
    angles = list(_angles(scenario, units))
    if scenario.units.angle == "rad":
        return [
            f"{one.where} is {one.value:g} rad, more than a whole turn; if it is in degrees, say "
            "`units: {angle: deg}`"
            for one in angles
            if abs(one.value) > WHOLE_TURN
        ]
    slips = []
    for joint, what in ((True, "joint angle"), (False, "angle of a pose")):
        alike = [one for one in angles if one.joint == joint]
        if _plausibly_radians(alike):
            largest = max(alike, key=lambda one: abs(one.value))
            slips.append(
                f"{largest.where} is {largest.value:g} degrees, and no {what} of the file is "
                "larger; if they are in radians, say `units: {angle: rad}`"
            )
    return slips


def _plausibly_radians(angles: list[_Angle]) -> bool:
    """None is above a whole turn, and one is a twelfth or an eighth of it, or most joints' odd."""
    values = np.array([abs(one.value) for one in angles if one.value])
    if not values.size or values.max() > WHOLE_TURN:
        return False
    for part in (np.pi / 4, np.pi / 6):
        times = np.round(values / part)
        if ((times > 0) & (np.abs(values - times * part) <= ROUNDED)).any():
            return True
    joints = np.array([abs(one.value) for one in angles if one.joint and one.value])
    odd = (2.0 * joints) % 1.0 != 0.0
    return bool(joints.size >= FEW and joints.max() >= LEAST_TURN and 2 * odd.sum() >= odd.size)


def _angles(scenario: Scenario, units: Mapping[str, str]) -> Iterator[_Angle]:
    for location, unit, value in numbers(scenario.task, ("angle", "angle or length")):
        joint = location[0] == "start" or location[2:3] == ("joints",)
        pose = unit == "angle" and location[0] != "tolerances"
        if pose or (joint and units.get(str(location[-1])) == "rad"):
            yield _Angle(scenario.where(*location), value, joint)
