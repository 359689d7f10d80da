"""The strip below a scene: segments with limiting constraints, curves over time and failures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from knotwork.verification import Finding, Motion
from knotwork.verification.finding import unite_intervals
from knotwork.verification.freedom_use import freedom_uses
from knotwork.view.clearance_curve import clearance_curve, nearest_around
from knotwork.view.limit_share import frame_values, limit_shares
from knotwork.view.scene_parts import packed_numbers
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.tool_curves import stretches
from knotwork.waypoints import FloatArray

SAMPLES = 800
# Shortest drawn failure, as a fraction of the motion.
LEAST_WIDTH = 0.003
# Use of a limit below which it does not limit.
NOTABLE = 0.01


def time_strip(shown: ShownMotion) -> dict[str, Any]:
    """Segments, use of limits, curves over time, failures and events.

    Returns:
        Times from the start of the motion [s].
    """
    curve, trajectory, scenario = shown.curve, shown.trajectory, shown.scenario
    start, end = float(curve.x[0]), float(curve.x[-1])
    time = np.linspace(start, end, SAMPLES)
    shares = list(limit_shares(shown.robot, curve, shown.space, shown.findings, time))
    asked = [
        [max(part.full_speed[0], low) - start, min(part.full_speed[1], high) - start, part.speed]
        for _, part, low, high in stretches(scenario, curve)
    ]
    use = np.max([np.zeros(SAMPLES), *(share for _, share in shares)], axis=0)
    return {
        "use": packed_numbers(use.astype("<f4")),
        "asked": asked,
        "broken": broken_spans(shown.failures, shares, time),
        "clearance": _clearance(shown),
        "speed_limit": scenario.motion_limits.tool_speed,
        "curves": [
            {**one, "time": (one["time"] - start).tolist()} for one in _more_curves(shown, time)
        ],
        "events": [[one.time - start, one.text] for one in trajectory.events],
        "segments": [
            [
                one.start - start,
                one.end - start,
                one.name,
                _limiting(one.start, one.end, shown.findings, shares, time),
            ]
            for one in trajectory.segments
        ],
    }


_Shares = list[tuple[Finding, FloatArray]]


def broken_spans(
    failures: Sequence[Finding], shares: _Shares, time: FloatArray
) -> list[list[float]]:
    """Time intervals of failures, since the start [s], long enough to be visible.

    Args:
        failures: Failures of the check.
        shares: Use of each limit from `limit_shares`.
        time: Times of these samples [s].
    """
    start, end = float(time[0]), float(time[-1])
    spans = [
        span for one in failures if one.at is not None for span in one.spans or ((one.at, one.at),)
    ]
    for one, share in shares:
        over = np.flatnonzero(np.diff(np.r_[False, (share > 1.0) & (not one.ok), False]))
        spans += [(float(time[i]), float(time[j - 1])) for i, j in over.reshape(-1, 2)]
    least = 0.5 * LEAST_WIDTH * (end - start)
    wide = unite_intervals((max(a - least, start), min(b + least, end)) for a, b in spans)
    return [[a - start, b - start] for a, b in wide]


def _limiting(
    start: float, end: float, findings: Sequence[Finding], shares: _Shares, time: FloatArray
) -> str:
    """Limiting constraint of a segment: that of the choice of times, else the limit nearest to it.

    Positions within their range are not constraints.
    """
    for one in findings:
        span = one.interval if one.quantity == "binding_limits" else None
        if span is not None and span[0] <= start and end <= span[1]:
            return one.label
    within = (time >= start) & (time <= end)
    slowing = [pair for pair in shares if pair[0].quantity != "position" or not pair[0].ok]
    if not slowing or not within.any():
        return ""
    one, share = max(slowing, key=lambda pair: float(pair[1][within].max()))
    most = float(share[within].max())
    if most < NOTABLE:
        return ""
    part = f"{100.0 * most:.0f} %" if np.isfinite(most) else "a jump"
    return f"{one.name} {one.title} {part}".lstrip()


def _more_curves(shown: ShownMotion, time: FloatArray) -> Iterator[dict[str, Any]]:
    """Speeds of limited links, and used freedom of paths, in the displayed units."""
    scenario, robot, curve = shown.scenario, shown.robot, shown.curve
    for one in scenario.motion_limits.frame_speeds:
        factor, unit = scenario.units.shown(1.0, "m/s")
        speed = frame_values(robot, one.frame, 1, *(curve(time, order) for order in range(3)))
        yield _curve(f"speed of {one.frame}", unit, time, factor * speed, [factor * one.speed])
    for path in freedom_uses(Motion(shown.trajectory, shown.space), scenario, robot):
        for (what, of), values in path.values.items() if path.subject == "path" else ():
            factor, unit = scenario.units.shown(1.0, of)
            bounds = [factor * edge for edge in path.bounds[what, of] if np.isfinite(edge)]
            yield _curve(f"{what}, {path.name}", unit, path.time, factor * values, bounds)


def _curve(
    name: str, unit: str, time: FloatArray, values: FloatArray, limits: list[float]
) -> dict[str, Any]:
    given = [float(f"{value:.5g}") for value in values]
    return {"name": name, "unit": unit, "time": time, "value": given, "limits": limits}


def _clearance(shown: ShownMotion) -> dict[str, Any] | None:
    """Clearance from the surroundings over time, the nearest pairs, and the required clearance."""
    trajectory, scenario, nearest = shown.trajectory, shown.scenario, nearest_around(shown.findings)
    also = [] if nearest is None or nearest.time is None else [nearest.time]
    start, end = trajectory.start_time, trajectory.end_time
    found = clearance_curve(trajectory, scenario, shown.space, (start, end), also)
    if found is None:
        return None
    return {
        "time": (found.time - start).tolist(),
        "distance": [round(d, 6) if np.isfinite(d) else None for d in found.distance.tolist()],
        "pair": found.pair,
        "names": found.names,
        "margin": scenario.scene.rules.margin,
    }
