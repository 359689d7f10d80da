"""What no limit forbids: limits that a robot does not have, and accelerations out of proportion."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.joint_quantities import JOINT_QUANTITIES, MAGNITUDES, rate_unit
from knotwork.joint_space import JointSpace
from knotwork.polynomial import PiecewisePolynomial
from knotwork.scenario import Scenario
from knotwork.verification.finding import Finding
from knotwork.verification.motion import Motion, between
from knotwork.verification.remedies import rounded_corner
from knotwork.waypoints import FloatArray

NO_LIMIT = "No limit known"
WINDOW = 0.1
"""An acceleration that lasts this long is part of the motion [s]; for a short motion see below."""
WINDOW_PART = 0.25
PROPORTION = 20.0
"""A spike is at least this many times as large as any acceleration that lasts."""
FEEBLE = 1.0
"""No spike is below this [rad/s² or m/s²]: drives don't feel it."""
HARMFUL = 1e3
"""A spike above this fails [rad/s² or m/s²]: no arm's joint accelerates like that."""
STEPS, MOST_SAMPLES = 10, 100_000


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
    """Find accelerations that are many times as large as any that the motion keeps up.

    A joint that accelerates by `a` for a while changes its velocity by as much. Where an
    acceleration peaks far above all that velocities change by, it is there and gone: nothing in the
    task asks for it.
    """
    peaks, times = (getattr(motion.curve.extrema(2), one) for one in ("peak", "peak_time"))
    kept_up, window = sustained(motion.curve)
    for unit in sorted(set(space.joint_units)):
        own = np.array([one == unit for one in space.joint_units])
        most = float(kept_up[own].max())
        allowed = max(PROPORTION * most, FEEBLE)
        for i in np.flatnonzero(own & (peaks > allowed)):
            name, value, time = space.joint_names[i], float(peaks[i]), float(times[i])
            as_text, acceleration = scenario.units.text, rate_unit(unit, 2)
            fails = space.robot is not None and value > HARMFUL
            proportion = f"{value / most:.3g} times the" if most else "far above the"
            yield Finding(
                group="Continuity",
                subject="joint",
                name=name,
                quantity="acceleration_spike",
                verdict="failed" if fails else "warning",
                message=f"joint {name!r}: acceleration peaks at {as_text(value, acceleration)} at "
                f"{time:.6g} s, {between(scenario, time)}: {proportion} "
                f"{as_text(most, acceleration)} that any joint keeps up for {window:.3g} s; "
                + (rounded_corner(time, scenario) or "a spike that nothing in the task asks for"),
                value=value,
                limit=allowed,
                margin=allowed - value,
                unit=acceleration,
                time=time,
            )


def sustained(curve: PiecewisePolynomial) -> tuple[FloatArray, float]:
    """Greatest accelerations that joints keep up for some time.

    Returns:
        Greatest changes of velocity within a window, over its length, shape (d,), and the length
        [s].
    """
    duration = float(curve.x[-1] - curve.x[0])
    step = max(min(WINDOW, WINDOW_PART * duration) / STEPS, duration / MOST_SAMPLES)
    v = curve(np.linspace(curve.x[0], curve.x[-1], round(duration / step) + 1), 1)
    changes = [np.abs(v[lag:] - v[:-lag]).max(axis=0) for lag in range(1, STEPS + 1)]
    return np.max(changes, axis=0) / (STEPS * step), STEPS * step
