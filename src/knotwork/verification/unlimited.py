"""Missing limits of a robot, and disproportionate peaks that no limit forbids."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from knotwork.joint_quantities import DERIVATIVES, JOINT_QUANTITIES, MAGNITUDES, rate_unit
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.polynomial.distinct import distinct
from knotwork.verification.checked_motion import AT_WAYPOINT, Motion, place_of_time
from knotwork.verification.finding import Finding
from knotwork.verification.remedies import rounded_corner
from knotwork.waypoints import FloatArray

NO_LIMIT = "No limit known"
SPIKE_RATIO = 20.0
"""Minimum ratio of a spike to the largest sustained value of all joints."""
SMALLEST_SPIKE = {2: 1.0, 3: 100.0}
"""Minimum of a spike by order [rad/s², rad/s³ or m]: drives follow smaller ones."""
HARMFUL_SPIKE = {2: 1e3, 3: np.inf}
"""A spike above this fails [rad/s², rad/s³ or m], because no arm reaches it. Jerk has no such
bound below that of a jump of acceleration."""
SUSTAINED_TIME = 0.1
"""Duration from which an acceleration counts as sustained [s]; less for quick moves, see below."""
MOVE_SHARE, MOTION_SHARE = 0.5, 0.25
"""Upper bounds of that duration, relative to the time between two waypoints and to the motion."""
JERK_SHARE = 0.1
"""Duration from which a jerk counts as sustained, relative to that of acceleration."""
WINDOW_STEPS, MOST_SPIKE_SAMPLES = 4, 100_000


def missing_limits(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Report missing limits of a robot, with the peaks of the motion."""
    if space.robot is None:
        return
    parts, short = [], []
    for quantity in MAGNITUDES:
        missing = np.flatnonzero(np.isinf(space.limits[quantity]))
        if not missing.size or (quantity == "effort" and space.robot.base_moves):
            continue
        order, subject, peak, place = JOINT_QUANTITIES[quantity].order, quantity, "", ""
        if missing.size < len(space.joint_names):
            subject += " of " + ", ".join(space.joint_names[i] for i in missing)
        if order is not None:
            extrema = motion.curve.extrema(order)
            i = int(missing[extrema.peak[missing].argmax()])
            unit = JOINT_QUANTITIES[quantity].units[space.joint_units[i]]
            peak = f" (peak {scenario.units.text(float(extrema.peak[i]), unit, '.4g')}"
            place = f", {space.joint_names[i]} at {extrema.peak_time[i]:.6g} s)"
        parts.append(f"{subject}{peak}{place}")
        short.append(f"{quantity}{peak})" if peak else quantity)
    if parts:
        yield Finding(
            NO_LIMIT, "motion", "", "missing_limits", "information",
            f"no limit is known for {space.robot.name} of {', '.join(parts)}",
            brief=", ".join(short),
        )  # fmt: skip


def spikes(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Find accelerations and jerks far above the largest sustained ones of the motion.

    A sustained acceleration shows in positions a short time apart. A peak far above what those
    explain is a spike that the task does not ask for. The same holds for jerk. A joint is reported
    once, by its acceleration first.
    """
    reported: set[str] = set()
    units = np.array(space.joint_units)
    for order in (2, 3):
        extrema, quantity = motion.curve.extrema(order), DERIVATIVES[order]
        for i in np.lexsort((np.arange(len(units)), units)):
            name, value = space.joint_names[i], float(extrema.peak[i])
            if name in reported or value <= SMALLEST_SPIKE[order]:
                continue
            time = float(extrema.peak_time[i])
            window = _sustained_time(time, motion, scenario) * (JERK_SHARE if order == 3 else 1.0)
            most = float(sustained_peaks(motion.curve, order, window)[units == units[i]].max())
            allowed = max(SPIKE_RATIO * most, SMALLEST_SPIKE[order])
            if value <= allowed:
                continue
            reported.add(name)
            fails = space.robot is not None and value > HARMFUL_SPIKE[order]
            unit = rate_unit(space.joint_units[i], order)
            peak, usual = (scenario.units.text(number, unit) for number in (value, most))
            ratio = f"{value / most:.3g} times the" if most else "far above the"
            cause = rounded_corner(time, scenario) or "nothing in the task asks for a spike"
            yield Finding(
                group="Continuity",
                subject="joint",
                name=name,
                quantity=f"{quantity}_spike",
                verdict="failed" if fails else "warning",
                fact=f"joint {name!r}: {quantity} peaks at {peak} at {time:.6g} s, "
                f"{place_of_time(scenario, time)}: {ratio} {usual} that any joint keeps up for "
                f"{window:.3g} s; {cause}",
                value=value,
                limit=allowed,
                margin=allowed - value,
                unit=unit,
                time=time,
            )


def _sustained_time(time: float, motion: Motion, scenario: Scenario) -> float:
    """Duration from which an acceleration at a time counts as sustained [s]."""
    moves = [
        MOVE_SHARE * (after.time - before.time)
        for before, after in pairwise(scenario.waypoints)
        if before.time - AT_WAYPOINT <= time <= after.time + AT_WAYPOINT
    ]
    return min(SUSTAINED_TIME, MOTION_SHARE * (motion.end_time - motion.start_time), *moves)


def sustained_peaks(curve: PiecewisePolynomial, order: int, window: float) -> FloatArray:
    """Maximum accelerations (order 2) or jerks (order 3) sustained over a window [s].

    Differences of positions give them: a short spike hardly changes positions, but it changes
    velocities.

    Returns:
        Maximum central differences of positions, over `window**order`, shape (d,).
    """
    start, end = float(curve.x[0]), float(curve.x[-1])
    half = 0.5 * order * window
    count = min(math.ceil(WINDOW_STEPS * (end - start) / window), MOST_SPIKE_SAMPLES)
    # for a long motion samples are sparse, so breaks and peaks are added
    middles = distinct(np.linspace(start, end, count), curve.x, curve.extrema(order).peak_time)
    t = np.clip(middles, start + half, end - half)
    differences = sum(
        (-1) ** k * math.comb(order, k) * curve(np.clip(t + half - k * window, start, end))
        for k in range(order + 1)
    )
    return np.asarray(np.abs(differences).max(axis=0) / window**order)
