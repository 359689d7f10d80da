"""Colours of the tool's path: by its speed, and where a speed is asked for by how far it is off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.scenario import Scenario
from knotwork.view.tool_curves import stretches
from knotwork.view.tool_trace import ToolTrace
from knotwork.waypoints import CartesianWaypoint, FloatArray

# Slow to fast: dark violet, blue, green, yellow; evenly lighter, so that it reads in grey, too.
SPEED_COLOURS = np.array(
    [
        [0.267, 0.005, 0.329],
        [0.231, 0.322, 0.545],
        [0.129, 0.569, 0.549],
        [0.369, 0.788, 0.384],
        [0.85, 0.87, 0.12],
    ]
)
# In their place where the speed along tool paths has the colours.
GREYS = np.array([[0.3, 0.31, 0.34], [0.74, 0.76, 0.79]])
# Slower than asked for, as asked for, faster
OFF_COLOURS = np.array([[0.13, 0.3, 0.85], [0.1, 0.62, 0.35], [0.93, 0.45, 0.05]])
# Speeds nearer to each other than this, in parts of the greatest, share a mark; and most of them.
APART, MOST_MARKS = 0.08, 3


class SpeedColours:
    """Colours of a path, and what the legend says of them.

    Attributes:
        colours: Of each sample of the path, shape (n, 3).
    """

    def __init__(
        self,
        path: ToolTrace,
        scenario: Scenario | None,
        curve: PiecewisePolynomial,
        asked: Sequence[CartesianWaypoint],
    ) -> None:
        self._tolerance = scenario.tolerances.path_speed if scenario is not None else 0.0
        self._waypoints = [float(np.linalg.norm(one.linear)) for one in asked]
        self._along = [part for _, part, *_ in stretches(scenario, curve)]
        # What fails may be slower than it is asked to be: the scale shows both.
        self._high = max([float(path.speed.max()), *(() if self._along else self._waypoints)])
        share = path.speed / self._high if self._high > 0 else np.zeros_like(path.speed)
        self.colours = mixed(share, GREYS if self._along else SPEED_COLOURS)
        for part in self._along:
            start, end = part.full_speed
            on = (path.time >= start) & (path.time <= end)
            off = (path.speed[on] / part.speed - 1.0) / self._tolerance
            self.colours[on] = mixed(0.5 + 0.5 * off, OFF_COLOURS)

    def legend(self) -> dict[str, Any]:
        """Scales with their colours, and the speeds asked for as marks on them [m/s]."""
        said: dict[str, Any] = {
            "high": self._high,
            "colours": written(GREYS if self._along else SPEED_COLOURS),
            "marks": [] if self._along else self._marks(self._waypoints),
        }
        if self._along:
            said["off_colours"] = written(OFF_COLOURS)
            said["off_tolerance"] = self._tolerance
            said["off_speeds"] = sorted({round(part.speed, 9) for part in self._along})
        return said

    def _marks(self, speeds: Sequence[float]) -> list[float]:
        marks: list[float] = []
        for speed in sorted(speeds, reverse=True):
            apart = all(abs(speed - other) > APART * self._high for other in marks)
            if speed > APART * self._high and apart and len(marks) < MOST_MARKS:
                marks.append(speed)
        return marks


def mixed(share: FloatArray, colours: FloatArray) -> FloatArray:
    """Colours for parts in 0 … 1 of a scale, shape (n, 3)."""
    at = np.linspace(0.0, 1.0, len(colours))
    return np.stack([np.interp(share, at, column) for column in colours.T], axis=1)


def written(colours: FloatArray) -> list[str]:
    """Colours as pages have them."""
    return ["#" + bytes(colour).hex() for colour in np.round(255 * colours).astype(np.uint8)]
