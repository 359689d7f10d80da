"""`TimedPath`: a tool path with its timing, the target of the tool at any time."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.extended_curve import ExtendedCurve
from knotwork.curves.tool_paths.task_frame import BASE_FRAME, TaskFrame, ToolMotion, add_weave
from knotwork.curves.tool_paths.timing_profile import Timing
from knotwork.curves.tool_paths.tool_path import LENGTH_MISMATCH, ToolPath
from knotwork.errors import PathError, TimeRangeError
from knotwork.errors.old_names import OldAttribute

STOP_SPEED_SHARE = 1e-6
"""Maximum speed at a stop, relative to the path's mean speed."""


class TimedPath:
    """Motion of the tool on a path over time.

    Args:
        path: The path.
        timing: Timing along the path.
        start_time: Start time [s].
        frame: Frame in which the path is fixed; by default the base frame.
        weave: Offset added to the path, in base axes with the frame at rest [m], shape (3,).
        breaks: Breaks of the weave, as times since the start [s].

    Attributes:
        tool_path: The path, with the frame at rest.
        timing, start_time, frame: The other arguments.
        woven_frame: The frame with the weave added. The tool follows the path in it.
        end_time: End time [s].
        breaks: Times of the breaks of curves, orientation, ramps and weave, and both ends [s].
        full_speed: Maximum speed along the path [m/s].
        is_wait: Whether the tool stays at the start of the path.

    Raises:
        PathError: Path and timing have different lengths, or the tool does not stop where the path
            needs a stop.

    >>> tp = kw.tool_paths
    >>> still = tp.OrientationCurve.constant(np.eye(3), 1)
    >>> path = tp.ToolPath([tp.Line([0, 0, 0], [1, 0, 0])], still)
    >>> timed = tp.TimedPath(path, tp.speed_profile([1], [0.25], acceleration=1), start_time=2)
    >>> timed.end_time, timed.pose(4.0).translation
    (6.0, array([0.5, 0. , 0. ]))
    """

    path = OldAttribute("tool_path")

    def __init__(
        self,
        path: ToolPath,
        timing: Timing,
        start_time: float = 0.0,
        frame: TaskFrame = BASE_FRAME,
        weave: ExtendedCurve | None = None,
        breaks: ArrayLike = (),
    ) -> None:
        self.tool_path, self.timing, self.start_time = path, timing, float(start_time)
        self.frame = frame
        self.woven_frame = frame if weave is None else add_weave(frame, weave)
        self.end_time = self.start_time + timing.duration
        length = float(timing(np.array([timing.duration]))[0])
        self.is_wait = not timing.arc_length.c.any()
        if not self.is_wait and abs(length - path.length) > LENGTH_MISMATCH * path.length:
            raise PathError(
                f"the timing is for {length:.12g} m and the path is {path.length:.12g} m long; "
                "both must be the same"
            )
        at_breaks = timing.time_of(path.breaks[1:-1])
        for i in sorted(path.stops):
            if i + 1 < len(path.starts):
                self._check_stop(i, float(path.starts[i + 1]))
        times = np.sort(np.concatenate((timing.arc_length.x, at_breaks, breaks)))
        is_new = np.diff(times, prepend=-np.inf) > 1e-12 * timing.duration
        local = times[is_new]
        # Between two breaks a time in the middle selects the pieces of path and timing.
        self._middle: FloatArray = 0.5 * (local[1:] + local[:-1])
        self._along: FloatArray = timing(self._middle)
        self.full_speed = float(timing.speeds[0] if self.is_wait else timing(local, 1).max())
        self.breaks: FloatArray = self.start_time + local
        self.breaks[-1] = self.end_time

    @property
    def has_own_clock(self) -> bool:
        """Whether frame or weave move over time, at any speed along the path."""
        return self.woven_frame.is_moving

    def _check_stop(self, curve: int, s: float) -> None:
        t = self.timing.time_of(np.array([s]))
        speed = float(np.abs(self.timing(t, 1))[0])
        if speed > STOP_SPEED_SHARE * self.tool_path.length / self.timing.duration:
            raise PathError(
                f"the path needs a stop after curve {curve + 1}, at arc length {s:.6g} m, but the "
                f"timing goes on at {speed:.6g} m/s there; name it in the timing's stops"
            )

    def _pieces(
        self, t: FloatArray, at: ArrayLike | None, side: ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Find the times since the start, and the intervals in which they are evaluated."""
        chosen = t if at is None else np.broadcast_to(np.asarray(at, dtype=float), t.shape)
        outside = ~((chosen >= self.start_time) & (chosen <= self.end_time))
        if outside.any():
            raise TimeRangeError(float(chosen[outside][0]), self.start_time, self.end_time)
        before, after = (np.searchsorted(self.breaks, chosen, end) for end in ("left", "right"))
        index = np.where(np.asarray(side) == "left", before, after) - 1
        return t - self.start_time, np.clip(index, 0, len(self._middle) - 1)

    def arc_length(self, t: ArrayLike) -> FloatArray:
        """Arc length at times [m], shape (k,)."""
        local, index = self._pieces(np.asarray(t, dtype=float), None, "right")
        return self.timing(local, 0, self._middle[index])

    def speed(self, t: ArrayLike) -> FloatArray:
        """Speed along the path at times [m/s], shape (k,)."""
        local, index = self._pieces(np.asarray(t, dtype=float), None, "right")
        return self.timing(local, 1, self._middle[index])

    def pose(self, t: float) -> pin.SE3:
        """Pose of the tool at a time [s]."""
        position, rotation, _, _ = self.state(np.array([t]))
        return pin.SE3(rotation[0], position[0])

    def state(
        self, t: ArrayLike, at: ArrayLike | None = None, side: ArrayLike = "right"
    ) -> ToolMotion:
        """Pose, velocity and acceleration of the tool, in base axes.

        Args:
            t: Times [s], shape (k,).
            at: Times that choose the pieces of path and timing, by default t [s], shape (k,): a
                piece is extended smoothly beyond its ends.
            side: Side of a break that is evaluated, `"right"` or `"left"`; or shape (k,).

        Raises:
            TimeRangeError: A time that chooses a piece is outside the path's.
        """
        local, index = self._pieces(np.asarray(t, dtype=float), at, side)
        middle, along = self._middle[index], self._along[index]
        s, ds, dds = (self.timing(local, order, middle) for order in range(3))
        ds, dds = ds[:, None], dds[:, None]
        path = self.tool_path
        position, tangent, bend = path.derivatives(s, 2, along)
        rotation, rate, change = path.orientation.states(s, along)
        twist = np.hstack((tangent * ds, rate * ds))
        acceleration = np.hstack((bend * ds**2 + tangent * dds, change * ds**2 + rate * dds))
        tool = ToolMotion(position, rotation, twist, acceleration)
        return self.woven_frame.tool_at(t, tool)

    def twist(self, t: float) -> pin.Motion:
        """Velocity of the tool at a time [s], in base axes."""
        return pin.Motion(self.state(np.array([t]))[2][0])

    def requested_speed(self, t: ArrayLike) -> FloatArray:
        """Full speed of the stretches that contain times [m/s], shape (k,)."""
        local = np.asarray(t, dtype=float) - self.start_time
        index = np.searchsorted(self.timing.times, local, "right") - 1
        return np.asarray(self.timing.speeds[np.clip(index, 0, len(self.timing.speeds) - 1)])
