"""What the strip below a scene's slider shows, and its panel of joints."""

from __future__ import annotations

from typing import Any

import numpy as np

from knotwork.joint_space import JointSpace
from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.units import Units
from knotwork.verification import Report
from knotwork.view.limit_share import limit_shares
from knotwork.view.packing import packed_numbers
from knotwork.view.tool_curves import stretches

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
        report: What the check found: the limits that it judged are those whose use is shown.

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
    time = np.linspace(start, end, SAMPLES)
    shares = (
        [share for _, share in limit_shares(robot, curve, space, report.findings, time)]
        if report is not None and space is not None
        else []
    )
    use = np.max([np.zeros(SAMPLES), *shares], axis=0)
    return {"use": packed_numbers(use.astype("<f4")), "asked": asked, "broken": broken}


def joint_panel(robot: Robot, units: Units) -> list[dict[str, Any]]:
    """Names, units and limits of the joints; `None` for a limit that there is not."""
    panel = []
    limits = zip(robot.lower_position_limit, robot.upper_position_limit, strict=True)
    for name, unit, bounds in zip(robot.joint_names, robot.joint_units, limits, strict=True):
        factor, shown = units.shown(1.0, unit)
        low, high = (factor * float(bound) if np.isfinite(bound) else None for bound in bounds)
        panel.append({"name": name, "unit": shown, "factor": factor, "low": low, "high": high})
    return panel
