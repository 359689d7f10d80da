"""`RequestedTiming`: a scenario's requirements on the speed along a path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from knotwork.curves import tool_paths
from knotwork.curves.tool_paths import Timing
from knotwork.errors import PathError, RampError, StretchTimeError

SPEED_ROUNDS = 100
"""Largest number of rounds until speeds from times and speeds at junctions agree."""

NOMINAL_SPEED = 0.01
"""Speed along a path until its speeds are chosen [m/s]: at low speed only its geometry matters."""


@dataclass(frozen=True)
class RequestedTiming:
    """Stretches of a path, each with a speed, a duration, or a speed to be chosen.

    Attributes:
        lengths: Lengths of the stretches [m].
        speeds: Speed along each [m/s]; `None` if it follows from a duration or is chosen.
        durations: Duration of each [s], or `None`.
        ends: Speeds at both ends of the path [m/s]; `None` for that of the stretch there.
        acceleration: Largest acceleration along the path where its speed changes [m/s²].
        max_speeds: Upper bounds of chosen speeds [m/s], by index, infinite without one.
    """

    lengths: tuple[float, ...]
    speeds: tuple[float | None, ...]
    durations: tuple[float | None, ...]
    ends: tuple[float | None, float | None]
    acceleration: float
    max_speeds: Mapping[int, float]

    def timed(
        self, chosen: Mapping[int, float] = MappingProxyType({})
    ) -> tuple[Timing, tuple[float, ...]]:
        """The timing, and the speed of each stretch [m/s].

        The speed at a junction is the lower one of its two stretches. Thus speeds from durations
        depend on each other, and an iteration finds them.

        Args:
            chosen: Chosen speeds of stretches [m/s], by index.

        Raises:
            PathError: A stretch is too short for its changes of speed, or a duration is infeasible.
        """
        count, ends = len(self.lengths), self.ends
        fixed = [chosen.get(k, speed) for k, speed in enumerate(self.speeds)]
        speeds = [
            length / duration if speed is None and duration is not None else float(speed or 0)
            for length, speed, duration in zip(self.lengths, fixed, self.durations, strict=True)
        ]
        for _ in range(SPEED_ROUNDS):
            before = list(speeds)
            for k in range(count):
                if fixed[k] is not None:
                    continue
                speed_before = ends[0] if k == 0 else speeds[k - 1]
                speed_after = ends[1] if k == count - 1 else speeds[k + 1]
                try:
                    speeds[k] = tool_paths.speed_for_duration(
                        self.lengths[k],
                        self.durations[k] or 0.0,
                        acceleration=self.acceleration,
                        start_speed=None
                        if speed_before is None or (k and speed_before >= speeds[k])
                        else speed_before,
                        end_speed=None
                        if speed_after is None or (k < count - 1 and speed_after >= speeds[k])
                        else speed_after,
                    )
                except (RampError, StretchTimeError) as error:
                    error.stretch = k
                    raise
            if np.allclose(speeds, before, rtol=1e-12, atol=0.0):
                break
        else:
            raise PathError(f"speeds of its stretches still change after {SPEED_ROUNDS} rounds")
        timing = tool_paths.speed_profile(
            self.lengths,
            speeds,
            start_speed=ends[0],
            end_speed=ends[1],
            acceleration=self.acceleration,
        )
        return timing, tuple(speeds)

    def at_nominal_speed(self) -> tuple[Timing, tuple[float, ...]]:
        """Timing of a path with chosen speeds, for its geometry: one low speed from end to end."""
        speeds = (NOMINAL_SPEED,) * len(self.lengths)
        timing = tool_paths.speed_profile(self.lengths, speeds, acceleration=self.acceleration)
        return timing, speeds
