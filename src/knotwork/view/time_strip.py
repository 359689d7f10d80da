"""The strip below a scene: segments and their active limits, curves and failures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import Segment
from knotwork.verification import Finding, Motion
from knotwork.verification.brief import NOTABLE_UTILISATION
from knotwork.verification.finding import unite_intervals
from knotwork.verification.freedom_use import sample_freedoms
from knotwork.view.clearance_curve import clearance_curve
from knotwork.view.plotted_utilisation import frame_values, sample_utilisation
from knotwork.view.scene_parts import pack_numbers
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.tool_curves import full_speeds

STRIP_SAMPLES = 800
MIN_FAILURE_WIDTH = 0.003
"""Minimum drawn duration of a failure, as a fraction of the motion."""
_Utilisations = list[tuple[Finding, FloatArray]]
"""Findings with the utilisation of their limits at sample times, from `sample_utilisation`."""


def time_strip(shown: ShownMotion) -> dict[str, Any]:
    """Collect segments, utilisation of limits, curves, failures and events as plain data.

    All times are since the start of the motion [s].
    """
    curve, trajectory, scenario = shown.curve, shown.trajectory, shown.scenario
    start, end = float(curve.x[0]), float(curve.x[-1])
    time = np.linspace(start, end, STRIP_SAMPLES)
    utilisations = list(sample_utilisation(shown, shown.findings, time))
    full_speed_spans = [
        [low - start, high - start, part.speed] for _, part, low, high in full_speeds(shown)
    ]
    by_limit = [utilisation for _, utilisation in utilisations]
    largest = np.max([np.zeros(STRIP_SAMPLES), *by_limit], axis=0)
    with np.errstate(over="ignore"):  # larger ones are infinite
        use = pack_numbers(largest.astype("<f4"))
    return {
        "use": use,
        "given": full_speed_spans,
        "exceeded": exceeded_spans(shown.failures, utilisations, time),
        "clearance": _clearance(shown),
        "speed_limit": scenario.motion_limits.tool_speed,
        "curves": [
            {**line, "time": (line["time"] - start).tolist()} for line in _more_curves(shown, time)
        ],
        "events": [[event.time - start, event.text] for event in trajectory.events],
        "segments": [
            [
                segment.start - start,
                segment.end - start,
                segment.name,
                _limit_text(segment, shown.findings, utilisations, time),
            ]
            for segment in trajectory.segments
        ],
    }


def exceeded_spans(
    failures: Sequence[Finding], utilisations: _Utilisations, time: FloatArray
) -> list[list[float]]:
    """Time intervals of failures, since the start [s], long enough to be visible.

    Args:
        failures: Failures of the check.
        utilisations: Utilisation of each limit from `sample_utilisation`.
        time: Times of these samples [s].
    """
    start, end = float(time[0]), float(time[-1])
    spans = [
        span
        for failure in failures
        if failure.shown_time is not None
        for span in failure.intervals or ((failure.shown_time, failure.shown_time),)
    ]
    for finding, utilisation in utilisations:
        over = np.flatnonzero(np.diff(np.r_[False, (utilisation > 1.0) & (not finding.ok), False]))
        spans += [(float(time[i]), float(time[j - 1])) for i, j in over.reshape(-1, 2)]
    least = 0.5 * MIN_FAILURE_WIDTH * (end - start)
    wide = unite_intervals((max(a - least, start), min(b + least, end)) for a, b in spans)
    return [[a - start, b - start] for a, b in wide]


def _limit_text(
    segment: Segment, findings: Sequence[Finding], utilisations: _Utilisations, time: FloatArray
) -> str:
    """Name the active limit of a segment, which chosen times have, or else its nearest limit.

    Positions within their range do not count.
    """
    start, end = segment.start, segment.end
    for finding in findings:
        span = finding.interval if finding.quantity == "active_limits" else None
        if span is not None and span[0] <= start and end <= span[1]:
            return finding.short_fact
    within = (time >= start) & (time <= end)
    slowing = [pair for pair in utilisations if pair[0].quantity != "position" or not pair[0].ok]
    if not slowing or not within.any():
        return ""
    limiting, utilisation = max(slowing, key=lambda pair: float(pair[1][within].max()))
    most = float(utilisation[within].max())
    if most < NOTABLE_UTILISATION:
        return ""
    part = f"{100.0 * most:.0f} %" if np.isfinite(most) else "a jump"
    return f"{limiting.name} {limiting.quantity_text} {part}".lstrip()


def _more_curves(shown: ShownMotion, time: FloatArray) -> Iterator[dict[str, Any]]:
    """Curves of the speeds of limited links, and of the free values of paths, in shown units."""
    scenario, robot, curve = shown.scenario, shown.robot, shown.curve
    for limit in scenario.motion_limits.link_speeds:
        factor, unit = scenario.units.shown(1.0, "m/s")
        speed = frame_values(robot, limit.link, 1, *(curve(time, order) for order in range(3)))
        yield _curve(f"speed of {limit.link}", unit, time, factor * speed, [factor * limit.speed])
    for path in sample_freedoms(Motion(shown.trajectory, shown.joints), scenario, robot):
        for (freedom, si_unit), values in path.values.items() if path.subject == "path" else ():
            factor, unit = scenario.units.shown(1.0, si_unit)
            bounds = [factor * edge for edge in path.bounds[freedom, si_unit] if np.isfinite(edge)]
            yield _curve(f"{freedom}, {path.name}", unit, path.time, factor * values, bounds)


def _curve(
    name: str, unit: str, time: FloatArray, values: FloatArray, limits: list[float]
) -> dict[str, Any]:
    rounded = [float(f"{value:.5g}") for value in values]
    return {"name": name, "unit": unit, "time": time, "value": rounded, "limits": limits}


def _clearance(shown: ShownMotion) -> dict[str, Any] | None:
    """Clearance from the surroundings over time, the nearest pairs, and the required clearance."""
    clearance = clearance_curve(shown)
    if clearance is None:
        return None
    return {
        **clearance._asdict(),
        "time": (clearance.time - shown.trajectory.start_time).tolist(),
        "distance": [round(d, 6) if np.isfinite(d) else None for d in clearance.distance.tolist()],
        "margin": shown.scenario.scene.margin,
    }
