"""Poses in moving frames: their times, and the requests that a moving frame excludes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.files.documents import Location
from knotwork.task import AtMost, PathWaypoint, PoseWaypoint
from knotwork.task.scenario.free_values_reader import FreeValues
from knotwork.task.scenario.task_in_si import TaskInSI, link_text

MAX_SPEED_JUMP = 1e-3
"""The largest speed jump of a frame that an arm can follow [m/s, rad/s]."""

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.curves.tool_paths.moving_frame import MovingFrame


def path_carrier(source: TaskInSI, first: int, last: int) -> MovingFrame | None:
    """The moving frame of a path.

    Args:
        source: The task in SI.
        first: The waypoint at the start of the path.
        last: The waypoint at its end.

    Raises:
        DocumentError: The waypoints do not move together.
    """
    carrier = source.carrier(last)
    for i in range(first, last):
        if _joints_of(source.carrier(i)) != _joints_of(carrier):
            raise source.locations.error(
                ("waypoints", i),
                f"does not move with waypoint {last + 1}, the next one of the path",
                "a path with all waypoints in one frame, including its start",
            )
    return carrier


def check_smooth(
    source: TaskInSI, i: int, carrier: MovingFrame | None, span: tuple[float, float]
) -> None:
    """Raise an error if the frame's speed jumps during a path.

    It jumps if the file of its motion gives positions without velocities.

    Args:
        source: The task in SI.
        i: The waypoint at the end of the path.
        carrier: The moving frame of the path.
        span: Time interval of the path [s].

    Raises:
        DocumentError: The speed jumps.
    """
    for name, frame in source.task.frames.items() if carrier is not None else ():
        joints = source.frames.moving[name].joints[-1:]
        if frame.moves is None or not set(joints) & set(_joints_of(carrier)):
            continue
        curve = joints[0].curve.between(*span)
        jumps = np.abs(curve.jumps(1))
        if jumps.max(initial=0.0) > MAX_SPEED_JUMP:
            k, axis = np.unravel_index(int(jumps.argmax()), jumps.shape)
            unit = "rad/s" if joints[0].turns[axis] else "m/s"
            jump = source.units.text(float(jumps[k, axis]), unit, ".3g")
            raise source.locations.error(
                ("waypoints", i),
                f"the tool is on the path to it from {span[0]:.4g} s to {span[1]:.4g} s, and "
                f"at {curve.x[k + 1]:.4g} s the speed of frame {name!r} jumps by {jump}, which "
                "no arm can follow",
                "a motion with velocities, such as a column y.velocity for y, that "
                "covers the whole path; or a path before or after that time",
            )


def neighbours_in_frame(
    source: TaskInSI, i: int, poses: Mapping[int, pin.SE3], times: Sequence[float]
) -> dict[int, pin.SE3]:
    """Poses near a waypoint, each at its time, relative to its moving frame.

    Args:
        source: The task in SI.
        i: The waypoint.
        poses: Poses of all waypoints, with all frames at rest.
        times: Times of all waypoints [s].
    """
    carrier = source.carrier(i)
    neighbours = {k: poses[k] for k in (i - 1, i, i + 1) if k in poses}
    for k, pose in neighbours.items():
        own_carrier = source.carrier(k)
        if _joints_of(own_carrier) != _joints_of(carrier):
            placed = pose if own_carrier is None else own_carrier.pose_at(pose, times[k])
            neighbours[k] = placed if carrier is None else carrier.pose_at_rest(placed, times[k])
    return neighbours


def axes_in_frame(source: TaskInSI, i: int, name: str, time: float) -> FloatArray:
    """Axes of a frame at a time, relative to the moving frame of a waypoint.

    Args:
        source: The task in SI.
        i: The waypoint.
        name: Name of the frame.
        time: Time [s].
    """
    carrier, axes_frame = source.carrier(i), source.frames.moving[name]
    if _joints_of(carrier) == axes_frame.joints:
        return np.array(source.frames[name].rotation)
    axes = np.array(axes_frame.placement_at(time).rotation)
    return axes if carrier is None else carrier.since_rest([time]).matrix[0, :3, :3].T @ axes


def refuse_excluded_keys(source: TaskInSI, i: int, waypoint: PoseWaypoint | PathWaypoint) -> None:
    """Refuse requests that moving frames do not support.

    Args:
        source: The task in SI.
        i: The waypoint.
        waypoint: Its definition.

    Raises:
        DocumentError: A chosen speed, or an orientation relative to another motion.
    """
    location: Location = ("waypoints", i)
    carrier, requested, moving = source.carrier(i), waypoint.orientation_in, source.frames.moving
    name = source.pose_frames[i]
    link, other_link = moving[name].link, link_text(source.pose_frame_link)
    if source.in_world(i) and carrier is not None:
        raise source.locations.error(
            location,
            f"is in frame {name!r}, which moves, and other poses are {other_link}",
            "a fixed frame, or a task without the other poses",
        )
    if isinstance(waypoint, PathWaypoint) and (source.in_world(i) or source.in_world(i - 1)):
        raise source.locations.error(
            location,
            f"ends a path with poses in the base, and other poses are {other_link}",
            f"a path with all waypoints {other_link}, or poses without along",
        )
    axes = getattr(getattr(waypoint, "velocity", None), "axes", None)
    for axes_name, *key in ((requested, "orientation_in"), (axes, "velocity", "in")):
        frame = moving.get(axes_name or "")
        if frame is not None and frame.link != link:
            raise source.locations.error(
                (*location, *key),
                f"frame {axes_name!r} is {link_text(frame.link)}, and the pose {link_text(link)}",
                "a frame that is fixed relative to the pose",
            )
    if requested is not None:
        joints = moving[source.frames.find(requested, (*location, "orientation_in"))].joints
        is_turning = any(any(part.turns) for part in (*_joints_of(carrier), *joints))
        if joints != _joints_of(carrier) and is_turning:
            raise source.locations.error(
                (*location, "orientation_in"),
                "rotates relative to the frame of the pose",
                "a frame with the same rotation",
            )
    if carrier is not None and isinstance(getattr(waypoint, "speed", None), str | AtMost):
        raise source.locations.error(
            (*location, "speed"),
            f"is chosen, but the motion of frame {name!r} depends on the time",
            "a speed" if isinstance(waypoint, PathWaypoint) else "a speed, or velocity: free",
        )


def add_time_dependent(source: TaskInSI, free: FreeValues, task_index: Sequence[int]) -> FreeValues:
    """The free values, including the waypoints whose pose depends on their time.

    Args:
        source: The task in SI.
        free: The free values so far.
        task_index: Index in the task of each waypoint of the scenario.

    Raises:
        DocumentError: The total duration is given as well.
    """
    in_moving_frames = [
        waypoint
        for waypoint in range(free.first_unknown_time, len(task_index))
        if source.carrier(task_index[waypoint]) is not None
    ]
    if in_moving_frames and free.total_duration is not None:
        name = source.pose_frames[task_index[in_moving_frames[0]]]
        raise source.locations.error(
            ("duration",),
            f"is given, and the time in moving frame {name!r} is chosen",
            "no duration, or time or after [s] at the waypoints in that frame and before",
        )
    time_dependent = tuple(sorted({*in_moving_frames, *free.time_dependent}))
    return replace(free, time_dependent=time_dependent)


def _joints_of(frame: MovingFrame | None) -> tuple[Any, ...]:
    return frame.joints if frame is not None else ()
