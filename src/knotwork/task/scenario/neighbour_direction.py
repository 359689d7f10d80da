"""Direction of the tool at a waypoint with only a given speed.

The smooth path through a waypoint P and its neighbours A and B is the circle through the three
(a straight line if they lie on one). With the chords h₁ = |P − A|, h₂ = |B − P| and their unit
vectors u₁, u₂, its tangent at P is along h₂ u₁ + h₁ u₂. The tool turns with the path at the
rate of its rotation over arc length, weighted in the same way.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.files.documents import Locations

MIN_CHORD = 1e-9
"""Minimum distance of waypoints that define a direction [m]."""
MIN_TANGENT = 1e-6
"""Minimum sum of the directions before and after a waypoint.

Below it the path reverses and defines no direction.
"""


class NoDirectionError(ValueError):
    """The neighbours of a waypoint define no direction."""


@dataclass(frozen=True)
class _Chord:
    length: float
    direction: FloatArray
    turn: FloatArray  # rotation from its start to its end, as a vector in base axes [rad]


def _chord(start: pin.SE3, end: pin.SE3) -> _Chord:
    step = end.translation - start.translation
    length = float(np.linalg.norm(step))
    if length < MIN_CHORD:
        raise NoDirectionError("a neighbouring waypoint is at the same position")
    turn = start.rotation @ pin.log3(start.rotation.T @ end.rotation)
    return _Chord(length, step / length, turn)


def _arc(chord: _Chord, tangent: FloatArray) -> float:
    """Arc length of the circle over a chord at a given angle to the tangent at one end."""
    along = float(chord.direction @ tangent)
    across = float(np.linalg.norm(chord.direction - along * tangent))
    angle = float(np.arctan2(across, along))
    return chord.length * angle / across if across > 1e-9 else chord.length


def _tangent(before: _Chord, after: _Chord) -> FloatArray:
    if np.linalg.norm(before.direction + after.direction) < MIN_TANGENT:
        raise NoDirectionError("the path reverses here")
    mean = after.length * before.direction + before.length * after.direction
    return np.asarray(mean / np.linalg.norm(mean))


def neighbours_twist(
    locations: Locations, i: int, speed: float, poses: Mapping[int, pin.SE3]
) -> pin.Motion:
    """Velocity at a waypoint of a file that gives only its speed.

    Args:
        locations: Locations of the parts of the file, for errors.
        i: Index of the waypoint.
        speed: Speed of the TCP [m/s].
        poses: Poses of its neighbours that have one, and its own.

    Returns:
        Velocity in base axes (`local_world_aligned`) [m/s, rad/s].

    Raises:
        DocumentError: Its neighbours define no direction.
    """
    location = ("waypoints", i, "speed")
    if i - 1 not in poses or i + 1 not in poses:
        raise locations.error(
            location,
            "the path's direction is undefined, because a neighbouring waypoint is given by joint "
            "values, or there is none",
            "velocity: {linear, angular}, or velocity: free, instead",
        )
    try:
        before, after = _chord(poses[i - 1], poses[i]), _chord(poses[i], poses[i + 1])
        tangent = _tangent(before, after)
    except NoDirectionError as error:
        raise locations.error(
            location, str(error), "velocity: {linear, angular} or stop: true instead"
        ) from error
    arcs = _arc(before, tangent), _arc(after, tangent)
    rates = before.turn / arcs[0], after.turn / arcs[1]
    rate = (arcs[1] * rates[0] + arcs[0] * rates[1]) / (arcs[0] + arcs[1])
    return pin.Motion(speed * tangent, speed * rate)
