"""What the strip below a scene's slider shows, and its panel of joints."""

from __future__ import annotations

from typing import Any

import numpy as np

from knotwork.joint_quantities import JOINT_QUANTITIES
from knotwork.joint_space import JointSpace
from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.units import Units
from knotwork.verification import Report
from knotwork.view.limit_share import limit_share
from knotwork.view.packing import packed_numbers
from knotwork.view.tool_curves import stretches
from knotwork.waypoints import FloatArray

SAMPLES = 800
# A break at one time is shown this wide, in parts of the motion.
LEAST_WIDTH = 0.003


def strip(
    robot: Robot,
    curve: PiecewisePolynomial,
    scenario: Scenario | None,
    space: JointSpace | None,
    report: Report | None,
) -> dict[str, Any]:
    """Give the use of limits, the speeds asked for along paths, and what is broken, over time.

    Args:
        robot: The arm.
        curve: Its motion, joints in the robot's order.
        scenario: The task.
        space: Its limits.
        report: What the check found.

    Returns:
        Times from the start of the motion [s].
    """
    start, end = float(curve.x[0]), float(curve.x[-1])
    found = report.failures if report is not None else ()
    least = 0.5 * LEAST_WIDTH * (end - start)
    broken = []
    for one in found:
        if one.at is not None:
            for low, high in one.spans or ((one.at, one.at),):
                broken.append([max(low - least, start) - start, min(high + least, end) - start])
    asked = [
        [max(part.full_speed[0], low) - start, min(part.full_speed[1], high) - start, part.speed]
        for _, part, low, high in stretches(scenario, curve)
    ]
    use = _use(robot, curve, space, np.linspace(start, end, SAMPLES))
    return {"use": packed_numbers(use.astype("<f4")), "asked": asked, "broken": broken}


def _use(
    robot: Robot, curve: PiecewisePolynomial, space: JointSpace | None, time: FloatArray
) -> FloatArray:
    """The most that any joint uses of any limit, shape of the time; 0 where there are none."""
    shares = [np.zeros((len(time), 1))]
    for quantity, kind in JOINT_QUANTITIES.items() if space is not None else ():
        lower, upper = space.bounds(quantity)  # type: ignore[union-attr]
        if not (np.isfinite(lower) | np.isfinite(upper)).any():
            continue
        if kind.order is None:
            states = zip(curve(time), curve(time, 1), curve(time, 2), strict=True)
            values = np.array([robot.torque(*state) for state in states])
        else:
            values = curve(time, kind.order)
        shares.append(np.nan_to_num(np.abs(limit_share(values, lower, upper))))
    return np.asarray(np.concatenate(shares, axis=1).max(axis=1))


def joint_panel(robot: Robot, units: Units) -> list[dict[str, Any]]:
    """Names, units and limits of the joints; `None` for a limit that there is not."""
    panel = []
    limits = zip(robot.lower_position_limit, robot.upper_position_limit, strict=True)
    for name, unit, bounds in zip(robot.joint_names, robot.joint_units, limits, strict=True):
        factor, shown = units.shown(1.0, unit)
        low, high = (factor * float(bound) if np.isfinite(bound) else None for bound in bounds)
        panel.append({"name": name, "unit": shown, "factor": factor, "low": low, "high": high})
    return panel
