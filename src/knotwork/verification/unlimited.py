"""What no limit forbids: limits that a robot does not have, and peaks out of proportion."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.distinct import distinct
from knotwork.joint_quantities import DERIVATIVES, JOINT_QUANTITIES, MAGNITUDES, rate_unit
from knotwork.joint_space import JointSpace
from knotwork.polynomial import PiecewisePolynomial
from knotwork.scenario import Scenario
from knotwork.verification.finding import Finding
from knotwork.verification.motion import Motion, between
from knotwork.verification.remedies import rounded_corner
from knotwork.waypoints import FloatArray

NO_LIMIT = "No limit known"
PROPORTION = 20.0
"""A spike is at least this many times as large as what any joint keeps up."""
FEEBLE = {2: 1.0, 3: 100.0}
"""No spike is below this, by order [rad/s², rad/s³ or m]: drives don't feel it."""
HARMFUL = {2: 1e3, 3: np.inf}
"""A spike above this fails [rad/s², rad/s³ or m]: no arm's joint accelerates like that. Jerk has no
such bound below the one above which acceleration jumps."""
WINDOW = 0.1
"""An acceleration that lasts this long is part of the motion [s]; for a short motion see below."""
WINDOW_PART = 0.25
STEPS, MOST_SAMPLES = 10, 100_000
"""A jerk that lasts for two of so many steps of a window is part of the motion."""


def missing_limits(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Say which limits a robot does not have, and what the motion reaches without them."""
    if space.robot is None:
        return
    parts, short = [], []
    for quantity in MAGNITUDES:
        missing = np.flatnonzero(np.isinf(space.limits[quantity]))
        if not missing.size:
            continue
        what = quantity
        if missing.size < len(space.joint_names):
            what += " of " + ", ".join(space.joint_names[i] for i in missing)
        peak = where = ""
        order = JOINT_QUANTITIES[quantity].order
        if order is not None:
            found = motion.curve.extrema(order)
            i = int(missing[found.peak[missing].argmax()])
            unit = JOINT_QUANTITIES[quantity].units[space.joint_units[i]]
            peak = f" (peak {scenario.units.text(float(found.peak[i]), unit, '.4g')}"
            where = f", {space.joint_names[i]} at {found.peak_time[i]:.6g} s)"
        parts.append(f"{what}{peak}{where}")
        short.append(f"{quantity}{peak}{')' if peak else ''}")
    if parts:
        yield Finding(
            group=NO_LIMIT,
            subject="motion",
            name="",
            quantity="missing_limits",
            verdict="information",
            message=f"no limit is known for {space.robot.name} of {', '.join(parts)}",
            brief=", ".join(short),
        )


def spikes(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Find accelerations and jerks that are many times as large as any that the motion keeps up.

    A joint that accelerates by `a` for a while changes its velocity by as much. Where an
    acceleration peaks far above all that velocities change by, it is there and gone: nothing in the
    task asks for it. So it is with jerk. A joint is named once, by its acceleration first.
    """
    named: set[str] = set()
    for order in (2, 3):
        peaks, times = (getattr(motion.curve.extrema(order), one) for one in ("peak", "peak_time"))
        kept_up, window = sustained(motion.curve, order)
        for unit in sorted(set(space.joint_units)):
            own = np.array([one == unit for one in space.joint_units])
            most = float(kept_up[own].max())
            allowed = max(PROPORTION * most, FEEBLE[order])
            for i in np.flatnonzero(own & (peaks > allowed)):
                name, value, time = space.joint_names[i], float(peaks[i]), float(times[i])
                if name in named:
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
                    message=f"joint {name!r}: {DERIVATIVES[order]} peaks at {words(value, rate)} "
                    f"at {time:.6g} s, {between(scenario, time)}: {proportion} "
                    f"{words(most, rate)} that any joint keeps up for {window:.3g} s; "
                    + (rounded_corner(time, scenario) or "nothing in the task asks for a spike"),
                    value=value,
                    limit=allowed,
                    margin=allowed - value,
                    unit=rate,
                    time=time,
                )


def sustained(curve: PiecewisePolynomial, order: int) -> tuple[FloatArray, float]:
    """Greatest accelerations (order 2) or jerks (order 3) that joints keep up for some time.

    Returns:
        Greatest changes of velocity within a window, over its length, shape (d,), and the length
        [s]; of jerk the greatest changes of the mean acceleration from one step to the next.
    """
    start, end = float(curve.x[0]), float(curve.x[-1])
    window = min(WINDOW, WINDOW_PART * (end - start))
    step = window / STEPS
    count = min(round(2.0 * (end - start) / step), MOST_SAMPLES)
    # of a long motion these are few, so wherever a peak may be there are more
    middles = distinct(np.linspace(start, end, count), curve.x, curve.extrema(order).peak_time)

    def change(lag: float) -> FloatArray:
        t = np.clip(middles, start + lag, end - lag)
        before, after = (curve(np.clip(t + by, start, end), 1) for by in (-lag, lag))
        found = after - before if order == 2 else after - 2.0 * curve(t, 1) + before
        return np.asarray(np.abs(found).max(axis=0))

    if order == 3:
        return change(step) / step**2, 2.0 * step
    changes = [change(0.5 * k * step) for k in range(1, STEPS + 1)]
    return np.max(changes, axis=0) / window, window
