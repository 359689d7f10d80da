"""The weaves of a scenario's paths: oscillations added over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.extended_curve import ExtendedCurve
from knotwork.curves.polynomial.two_point import two_point_coefficients
from knotwork.curves.tool_paths import Timing, ToolPath
from knotwork.curves.tool_paths.weave import (
    BREAK_TIME_TOLERANCE,
    WEAVE_AXES,
    WeavePattern,
    weave_offsets,
)
from knotwork.errors import DocumentError
from knotwork.task import PathWaypoint, Weave
from knotwork.task.scenario.path_curves import PathCurves

MIN_PERIODS, MAX_PERIODS = 2, 10_000
"""Minimum and maximum number of periods.

A weave widens in the first period and narrows in the last one.
"""


@dataclass(frozen=True, eq=False)
class WeaveReader:
    """Reads the weaves of a path.

    Attributes:
        curves: The task, and the curves of its paths.
        first: Index in the task of the waypoint at the start of the path.
        waypoints: The other waypoints of the path.
    """

    curves: PathCurves
    first: int
    waypoints: Sequence[PathWaypoint]

    def read(
        self, path: ToolPath, timing: Timing, start: float
    ) -> tuple[list[WeavePattern | None], ExtendedCurve, FloatArray]:
        """The weave of each stretch, their sum, and the times at which a new weave begins [s].

        Consecutive stretches with the same weave have one continuous weave.

        Args:
            path: The path.
            timing: Its timing.
            start: Start time [s].

        Raises:
            DocumentError: A weave is too short, fast or narrow, or along the seam.
        """
        for k, waypoint in enumerate(self.waypoints):
            if not isinstance(waypoint.speed, float | None):
                raise self._error(k, "is chosen on a path with a weave", "a speed", "speed")
        weaves: list[WeavePattern | None] = []
        times, states, breaks = [np.zeros(1)], [np.zeros((3, 1, 3))], []
        for requested, same in groupby(waypoint.weave for waypoint in self.waypoints):
            low, high = len(weaves), len(weaves) + len([*same])
            weave = None
            if requested is not None:
                begin, end = (float(timing.times[k]) for k in (low, high))
                weave, normal = self._weave(low, requested, end - begin)
                with self.curves.errors_at(self.first + 1 + low, "weave", "normal"):
                    t, state = weave_offsets(weave, path, timing, begin, normal)
                skipped = int(t[0] <= times[-1][-1] + BREAK_TIME_TOLERANCE)
                times.append(t[skipped:])
                states.append(state[:, skipped:])
                breaks.append(begin + weave.breaks())
            weaves += [weave] * (high - low)
        x, states_at_x = np.concatenate(times), np.concatenate(states, axis=1)
        curve = PiecewisePolynomial(
            two_point_coefficients(x, (states_at_x[0], states_at_x[1], states_at_x[2])), x
        )
        return weaves, ExtendedCurve(curve, delay=start), np.concatenate(breaks)

    def _error(self, k: int, fault: str, accepted: str, *key: str) -> DocumentError:
        return self.curves.reading.locations.error(
            ("waypoints", self.first + 1 + k, *(key or ("weave",))), fault, accepted
        )

    def _weave(
        self, k: int, requested: Weave, duration: float
    ) -> tuple[WeavePattern, FloatArray | None]:
        """The weave that begins on a stretch, by index, and its given normal."""
        text = self.curves.reading.units.text
        periods = duration * requested.frequency
        if not MIN_PERIODS <= periods <= MAX_PERIODS:
            low, high = (count / duration for count in (MIN_PERIODS, MAX_PERIODS))
            raise self._error(
                k,
                f"takes {duration:.4g} s at {requested.frequency:g} Hz: {periods:.4g} periods",
                f"{MIN_PERIODS} to {MAX_PERIODS} periods: {low:.4g} to {high:.4g} Hz here",
                "weave",
                "frequency",
            )
        allowed = self.curves.reading.task.tolerances.path
        if requested.width <= 2.0 * allowed:
            raise self._error(
                k,
                f"is {text(requested.width, 'm')}, within the tolerance of the path on both sides",
                f"more than {text(2.0 * allowed, 'm')}, or less in tolerances: {{path: …}}",
                "weave",
                "width",
            )
        axes = requested.axes or (("across", "along") if requested.is_loop else ("across",))
        weave = WeavePattern(
            shape=requested.shape,
            width=requested.width,
            frequency=requested.frequency,
            axes=tuple(WEAVE_AXES.index(axis) for axis in axes),
            dwell=requested.dwell or 0.0,
            rounding=requested.rounding or allowed,
            duration=duration,
        )
        if requested.normal is None:
            return weave, None
        frame = self.curves.reading.pose_frames[self.first + 1 + k].rest_placement
        return weave, frame.rotation @ np.array(requested.normal)
