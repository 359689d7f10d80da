"""`WeavePattern`: offset of a tool from its path over time, in the axes of seam and surface.

The axes are along the seam, across it to the left, and out of the surface. Circles and eights are
harmonic. From edge to edge the speed u is constant, except for ramps u S(t/τ) within the times τ
next to the edges, where S(z) = 3 z² - 2 z³. A sine with a dwell has the maximum τ, which is half of
a crossing. The offset is multiplied by a smooth step over the first and the last period, so that
the weave begins and ends on the seam, at rest and without acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.tool_paths.curve import Curve
from knotwork.curves.tool_paths.orientation import OrientationCurve
from knotwork.curves.tool_paths.seam import seam_frames
from knotwork.curves.tool_paths.tangent import tangent_orientation
from knotwork.curves.tool_paths.timing_profile import Timing
from knotwork.curves.tool_paths.tool_path import ToolPath

HARMONICS = {
    "sine": ((1.0, 1, 0.0),),
    "circle": ((1.0, 1, 0.0), (1.0, 1, 0.5 * math.pi)),
    "eight": ((1.0, 1, 0.0), (0.5, 2, 0.0)),
}
"""Amplitude relative to half the width, multiple of the frequency, and phase [rad] of each axis."""

WEAVE_AXES = ("along", "across", "normal")

MAX_TURN_SHARE = 0.5
"""Maximum fraction of a crossing in which the speed increases, and in which it decreases."""

BREAK_DIGITS = 6
"""Number of digits to which breaks are rounded [s], so that they are not too close."""

BREAK_TIME_TOLERANCE = 10.0**-BREAK_DIGITS
"""Time within which two breaks are one [s]."""

PIECES_PER_BREAK = 8
"""Quintic pieces between two breaks of a weave. The error relative to the width is about 1e-8 for a
sine, and 2e-6 for a triangle with sharp turns."""


@dataclass(frozen=True)
class WeavePattern:
    """A weave in the axes of its seam.

    Attributes:
        shape: `"sine"`, `"triangle"`, `"circle"` or `"eight"`.
        width: Width from edge to edge [m].
        frequency: Frequency [Hz].
        axes: Indices of its axes: 0 along, 1 across, 2 normal.
        dwell: Dwell time at each edge [s].
        rounding: Maximum deviation of a triangle from one with sharp corners [m].
        duration: Duration [s], at least two periods.
    """

    shape: str
    width: float
    frequency: float
    axes: tuple[int, ...]
    dwell: float
    rounding: float
    duration: float

    @property
    def crossing(self) -> float:
        """Time from edge to edge [s]."""
        return 0.5 / self.frequency - self.dwell

    @property
    def turn(self) -> float:
        """Duration of the ramps of speed next to an edge [s]; 0 for harmonic shapes."""
        if self.shape in HARMONICS and not self.dwell:
            return 0.0
        share = MAX_TURN_SHARE if self.shape == "sine" else 2.0 * self.rounding / self.width
        return min(share, MAX_TURN_SHARE) * self.crossing

    def breaks(self, *others: FloatArray) -> FloatArray:
        """Breaks of the weave from 0 to its duration, merged with others [s]."""
        half = 0.5 / self.frequency
        marks = np.array([0.0, 0.25 / self.frequency])
        if self.turn:
            marks = np.array([0.0, self.turn, self.crossing - self.turn, self.crossing])
            marks -= 0.5 * self.crossing
        halves = np.arange(math.ceil(self.duration / half) + 1)
        ramps = np.array([1.0, self.duration * self.frequency - 1.0]) / self.frequency
        inner = np.concatenate(((halves[:, None] * half + marks).ravel(), ramps, *others))
        inner = np.round(inner, BREAK_DIGITS)
        inside = (inner > BREAK_TIME_TOLERANCE) & (inner < self.duration - BREAK_TIME_TOLERANCE)
        return sort_distinct(inner[inside], 0.0, self.duration)

    def offsets(self, t: FloatArray) -> FloatArray:
        """Offset from the seam, velocity and acceleration in the weave's axes [m, m/s, m/s²].

        Args:
            t: Times since the start [s], shape (k,).

        Returns:
            Shape (3, k, 3).
        """
        offset = np.zeros((3, len(t), 3))
        for number, axis in enumerate(self.axes):
            values = self._crossing_offset(t) if self.turn else self._harmonic(t, number)
            offset[:, :, axis] = values
        z = np.clip(np.minimum(t, self.duration - t) * self.frequency, 0.0, 1.0)
        sign = np.where(t < 0.5 * self.duration, self.frequency, -self.frequency)
        rise = z**3 * (10.0 - 15.0 * z + 6.0 * z**2)
        rate = sign * 30.0 * (z * (1.0 - z)) ** 2
        change = self.frequency**2 * 60.0 * z * (1.0 - z) * (1.0 - 2.0 * z)
        w, v, a = offset
        rise, rate, change = (values[:, None] for values in (rise, rate, change))
        return np.asarray((rise * w, rate * w + rise * v, change * w + 2.0 * rate * v + rise * a))

    def _harmonic(self, t: FloatArray, number: int) -> FloatArray:
        amplitude, multiple, phase = HARMONICS[self.shape][number]
        rate = 2.0 * math.pi * self.frequency * multiple
        return np.array(
            [
                0.5
                * self.width
                * amplitude
                * rate**k
                * np.sin(rate * t + phase + 0.5 * k * math.pi)
                for k in range(3)
            ]
        )

    def _crossing_offset(self, t: FloatArray) -> FloatArray:
        """Offset across the seam, from edge to edge and back, starting in the middle."""
        crossing, turn = self.crossing, self.turn
        speed = self.width / (crossing - turn)
        count, since = np.divmod(t + 0.5 * crossing, 0.5 / self.frequency)
        direction = np.where(count % 2.0, -1.0, 1.0)
        since = np.minimum(since, crossing)
        rising = since < 0.5 * crossing
        side = np.where(rising, 1.0, -1.0)
        from_edge = np.where(rising, since, crossing - since)  # time since or until the nearer edge
        z = np.minimum(from_edge / turn, 1.0)
        distance = speed * (turn * z**3 * (1.0 - 0.5 * z) + np.maximum(from_edge - turn, 0.0))
        rates = speed * z**2 * (3.0 - 2.0 * z), side * speed * 6.0 * z * (1.0 - z) / turn
        return np.asarray(direction * np.array([side * (distance - 0.5 * self.width), *rates]))


def seam_axes(curves: Sequence[Curve]) -> OrientationCurve:
    """Axes that turn with a path and not about it, the first axis along it.

    Between curves with different rates of rotation the transition is smooth: see
    `OrientationCurve.joined`.
    """
    T = curves[0].position([0.0], 1)
    R, turns = seam_frames(T, np.eye(3)[int(np.abs(T[0]).argmin())])[0], []
    for curve in curves:
        turns.append(tangent_orientation(curve, R))
        R = turns[-1].rotations[-1]
    return OrientationCurve.joined(turns)


def weave_offsets(
    weave: WeavePattern, path: ToolPath, timing: Timing, start: float, normal: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Offset of a weave from a path in base axes, at times that are dense enough for quintics.

    Args:
        weave: The weave.
        path: The path.
        timing: The timing of the path.
        start: Start time of the weave, since the start of the path [s].
        normal: Surface normal at the start in base axes, shape (3,); by default opposite to the
            tool's z axis.

    Returns:
        Times since the start of the path [s], shape (k,); offset, velocity and acceleration
        [m, m/s, m/s²], shape (3, k, 3).

    Raises:
        PathError: The normal is along the seam.
    """
    seam = seam_axes(path.curves)
    s0 = timing(np.array([start]))
    normal = -path.rotation(s0)[0, :, 2] if normal is None else normal
    R = seam.rotation(s0)
    about = R[0].T @ seam_frames(R[:, :, 0], normal)[0]
    breaks = timing.time_of(sort_distinct(path.breaks, seam.breaks)), timing.arc_length.x
    marks = weave.breaks(*(times - start for times in breaks))
    t = np.interp(
        np.arange((len(marks) - 1) * PIECES_PER_BREAK + 1) / PIECES_PER_BREAK,
        np.arange(len(marks)),
        marks,
    )
    s, ds, dds = (timing(start + t, order) for order in range(3))
    rate, change = seam.rate(s), seam.rate(s, 1)
    ds, dds = ds[:, None], dds[:, None]
    omega = rate * ds
    alpha = change * ds**2 + rate * dds
    offsets = weave.offsets(t) @ about.T
    # the seam's axes turn with angular velocity omega and acceleration alpha
    w, v, a = np.einsum("kij,nkj->nki", seam.rotation(s), offsets)
    carried = np.cross(omega, w)
    relative = np.cross(alpha, w) + np.cross(omega, carried + 2.0 * v)
    return start + t, np.array([w, v + carried, a + relative])
