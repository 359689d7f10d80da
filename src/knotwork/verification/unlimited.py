"""Missing limits of a robot, and disproportionate peaks that no limit forbids."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from knotwork.joint_quantities import DERIVATIVES, JOINT_QUANTITIES, MAGNITUDES, rate_unit
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.distinct import distinct
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.verification.checked_motion import AT_WAYPOINT, Motion, between
from knotwork.verification.finding import Finding
from knotwork.verification.remedies import rounded_corner
from knotwork.waypoints import FloatArray

NO_LIMIT = "No limit known"
PROPORTION = 20.0
"""Minimum ratio of a spike to the largest sustained value of all joints."""
FEEBLE = {2: 1.0, 3: 100.0}
"""Minimum of a spike by order [rad/s², rad/s³ or m]: drives follow smaller ones."""
HARMFUL = {2: 1e3, 3: np.inf}
"""A spike above this fails [rad/s², rad/s³ or m], because no arm reaches it. Jerk has no such
bound below that of a jump of acceleration."""
WINDOW = 0.1
"""Duration from which an acceleration counts as sustained [s]; less for quick moves, see below."""
PART_OF_MOVE, PART_OF_MOTION = 0.5, 0.25
"""Upper bounds of that duration, relative to the time between two waypoints and to the motion."""
JERK_PART = 0.1
"""Duration from which a jerk counts as sustained, relative to that of acceleration."""
STEPS, MOST_SAMPLES = 4, 100_000


def missing_limits(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Report missing limits of a robot, with the peaks of the motion."""
    if space.robot is None:
        return
    parts, short = [], []
    for quantity in MAGNITUDES:
        missing = np.flatnonzero(np.isinf(space.limits[quantity]))
        if not missing.size or (quantity == "effort" and space.robot.base_moves):
            continue
        order, what = JOINT_QUANTITIES[quantity].order, quantity
        if missing.size < len(space.joint_names):
            what += " of " + ", ".join(space.joint_names[i] for i in missing)
        if order is None:
            parts.append(what)
            short.append(quantity)
            continue
        found = motion.curve.extrema(order)
        i = int(missing[found.peak[missing].argmax()])
        unit = JOINT_QUANTITIES[quantity].units[space.joint_units[i]]
        peak = f"(peak {scenario.units.text(float(found.peak[i]), unit, '.4g')}"
        parts.append(f"{what} {peak}, {space.joint_names[i]} at {found.peak_time[i]:.6g} s)")
        short.append(f"{quantity} {peak})")
    if parts:
        yield Finding(
            group=NO_LIMIT,
            subject="motion",
            name="",
            quantity="missing_limits",
            verdict="information",
            fact=f"no limit is known for {space.robot.name} of {', '.join(parts)}",
            brief=", ".join(short),
        )


def spikes(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Find accelerations and jerks far above the largest sustained ones of the motion.

    A sustained acceleration shows in positions a short time apart. A peak far above what those
    explain is a spike that the task does not ask for. The same holds for jerk. A joint is reported
    once, by its acceleration first.
    """
    named: set[str] = set()
    for order in (2, 3):
        found = motion.curve.extrema(order)
        peaks, times = found.peak, found.peak_time
        for unit in sorted(set(space.joint_units)):
            own = np.array([one == unit for one in space.joint_units])
            for i in np.flatnonzero(own & (peaks > FEEBLE[order])):
                name, value, time = space.joint_names[i], float(peaks[i]), float(times[i])
                window = _window(time, motion, scenario) * (JERK_PART if order == 3 else 1.0)
                most = float(sustained(motion.curve, order, window)[own].max())
                allowed = max(PROPORTION * most, FEEBLE[order])
                if name in named or value <= allowed:
                    continue
                named.add(name)
                fails = space.robot is not None and value > HARMFUL[order]
                words, rate = scenario.units.text, rate_unit(unit, order)
                proportion = f"{value / most:.3g} times the" if most else "far above the"
                yield Finding(
                    group="Continuity",
                    subject="joint",
                    name=name,
                    quantity=f"{DERIVATIVES[order]}_spike",
                    verdict="failed" if fails else "warning",
                    fact=f"joint {name!r}: {DERIVATIVES[order]} peaks at {words(value, rate)} "
                    f"at {time:.6g} s, {between(scenario, time)}: {proportion} "
                    f"{words(most, rate)} that any joint keeps up for {window:.3g} s; "
                    + (rounded_corner(time, scenario) or "nothing in the task asks for a spike"),
                    value=value,
                    limit=allowed,
                    margin=allowed - value,
                    unit=rate,
                    time=time,
                )


def _window(time: float, motion: Motion, scenario: Scenario) -> float:
    """Duration from which an acceleration at a time counts as sustained [s]."""
    around = [
        after.time - before.time
        for before, after in pairwise(scenario.waypoints)
        if before.time - AT_WAYPOINT <= time <= after.time + AT_WAYPOINT
    ]
    whole = PART_OF_MOTION * (motion.end_time - motion.start_time)
    return min(WINDOW, whole, *(PART_OF_MOVE * move for move in around))


def sustained(curve: PiecewisePolynomial, order: int, window: float) -> FloatArray:
    """Maximum accelerations (order 2) or jerks (order 3) sustained over a window [s].

    Differences of positions give them: a short spike hardly changes positions, but it changes
    velocities.

    Returns:
        Maximum central differences of positions, over `window**order`, shape (d,).
    """
    start, end = float(curve.x[0]), float(curve.x[-1])
    half = 0.5 * order * window
    count = min(math.ceil(STEPS * (end - start) / window), MOST_SAMPLES)
    # for a long motion samples are sparse, so breaks and peaks are added
    middles = distinct(np.linspace(start, end, count), curve.x, curve.extrema(order).peak_time)
    t = np.clip(middles, start + half, end - half)
    found = sum(
        (-1) ** k * math.comb(order, k) * curve(np.clip(t + half - k * window, start, end))
        for k in range(order + 1)
    )
    return np.asarray(np.abs(found).max(axis=0) / window**order)
