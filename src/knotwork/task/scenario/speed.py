"""Direction of the tool at a waypoint with only a given speed.

The smooth path through a waypoint P and its neighbours A and B is the circle through the three
(a straight line if they lie on one). With the chords h₁ = |P − A|, h₂ = |B − P| and their unit
vectors u₁, u₂, its tangent at P is along h₂ u₁ + h₁ u₂. The tool turns with the path at the
rate of its rotation over arc length, weighted in the same way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from knotwork.files.documents import Places
from knotwork.task import Task
from knotwork.waypoints import FloatArray

# Minimum distance of waypoints that define a direction [m].
SMALLEST_CHORD = 1e-9
# Minimum sum of the directions before and after a waypoint. Below it the path reverses and defines
# no direction.
SMALLEST_TANGENT = 1e-6


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
    if length < SMALLEST_CHORD:
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
    if np.linalg.norm(before.direction + after.direction) < SMALLEST_TANGENT:
        raise NoDirectionError("the path reverses here")
    mean = after.length * before.direction + before.length * after.direction
    return np.asarray(mean / np.linalg.norm(mean))


def passing_twist(poses: Sequence[pin.SE3], index: int, speed: float) -> pin.Motion:
    """Velocity of a tool that passes a pose at a given speed along the smooth path.

    At the first and the last pose the path is the circle through the three poses at that end;
    with two poses it is the straight line.

    Args:
        poses: The waypoints in order, in the base frame.
        index: Index of the pose.
        speed: Speed of the tool [m/s].

    Returns:
        Velocity in base axes (`local_world_aligned`) [m/s, rad/s].

    Raises:
        NoDirectionError: A neighbour is at the same position, or the path reverses.
    """
    last = len(poses) - 1
    if last == 1:
        chord = _chord(poses[0], poses[1])
        return pin.Motion(speed * chord.direction, speed * chord.turn / chord.length)
    middle = min(max(index, 1), last - 1)
    before = _chord(poses[middle - 1], poses[middle])
    after = _chord(poses[middle], poses[middle + 1])
    tangent = _tangent(before, after)
    arcs = _arc(before, tangent), _arc(after, tangent)
    rates = before.turn / arcs[0], after.turn / arcs[1]
    if index == middle:
        rate = (arcs[1] * rates[0] + arcs[0] * rates[1]) / (arcs[0] + arcs[1])
        return pin.Motion(speed * tangent, speed * rate)
    end = before if index < middle else after
    mirrored = 2 * (tangent @ end.direction) * end.direction - tangent
    return pin.Motion(speed * mirrored, speed * (rates[0] if index < middle else rates[1]))


def neighbours_twist(
    file: Task, places: Places, i: int, speed: float, poses: Mapping[int, pin.SE3]
) -> pin.Motion:
    """Velocity at a waypoint of a file that gives only its speed.

    Args:
        file: Content of the file, in SI.
        places: Locations of its parts in the file, for errors.
        i: Index of the waypoint.
        speed: Speed of the TCP [m/s].
        poses: Poses of all waypoints that have one.

    Raises:
        DocumentError: Its neighbours define no direction.
    """
    location = ("waypoints", i, "speed")
    first = i
    while first - 1 in poses and first > i - 2:
        first -= 1
    last = i
    while last + 1 in poses and last < i + 2:
        last += 1
    # The neighbours determine it. A further waypoint is only needed at the two ends of the motion.
    at_start = i == 0 and file.start is None
    at_end = i == len(file.waypoints) - 1
    if (first == i and not at_start) or (last == i and not at_end) or first == last:
        raise places.error(
            location,
            "the path's direction is undefined, because a neighbouring waypoint is given by joint "
            "values",
            "velocity: {linear, angular}, or velocity: free, instead",
        )
    if not at_start and not at_end:
        first, last = i - 1, i + 1
    try:
        return passing_twist([poses[k] for k in range(first, last + 1)], i - first, speed)
    except NoDirectionError as error:
        raise places.error(
            location, str(error), "velocity: {linear, angular} or stop: true instead"
        ) from error
