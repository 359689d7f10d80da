"""The joints a scenario is about: its robot with its tool and limits, or bare joints without one.

What plans a scenario and what checks it both start here, so both speak of the same joints.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knotwork.errors import UnknownNameError
from knotwork.joint_quantities import MAGNITUDES
from knotwork.scenario import JointValues, LimitOverrides, Scenario
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from knotwork.robot import Robot


@dataclass(frozen=True)
class JointSpace:
    """Joints with their units and limits, and the robot they belong to, if any.

    Attributes:
        joint_names: Names, length d.
        joint_units: `"rad"` or `"m"` for each joint.
        lower_position_limit, upper_position_limit: [rad or m], shape (d,); infinite where there
            is none.
        limits: Largest magnitude by quantity: `"velocity"`, `"acceleration"`, `"jerk"` (of rad
            or m) and `"effort"` [N m or N], each of shape (d,), infinite where none is given.
        configurations: Named joint positions, each of shape (d,).
        robot: The robot with the scenario's tool and position limits, or `None`.
    """

    joint_names: tuple[str, ...]
    joint_units: tuple[str, ...]
    lower_position_limit: FloatArray
    upper_position_limit: FloatArray
    limits: Mapping[str, FloatArray]
    configurations: Mapping[str, FloatArray]
    robot: Robot | None = None

    def values(self, given: JointValues, *, missing: float | None = None) -> FloatArray:
        """Read joint values of the scenario as an array of shape (d,) in SI.

        Raises:
            DocumentError: A joint or configuration is unknown, or a joint is left out.
        """
        return given.array(self.joint_names, self.joint_units, self.configurations, missing=missing)


def joint_space(scenario: Scenario) -> JointSpace:
    """Load what a scenario moves: its robot with tool and limits, or its bare joints.

    Raises:
        InputError: The robot, its tool frame or a joint named in the scenario's limits does not
            exist, or the robot can't be planned for.
    """
    if scenario.robot is None:
        return _bare_joints(scenario)
    from knotwork.robot import load_robot

    with scenario.error_context("robot"):
        robot = load_robot(scenario.robot, relative_to=scenario.relative_to)
    with scenario.error_context("tool", "frame"):
        robot = robot.with_tool(frame=scenario.tool.frame, offset=scenario.tool.offset)
    with scenario.error_context("robot"):
        robot.require_tool()
    names, units = robot.joint_names, robot.joint_units
    position = _position_overrides(scenario.limits, names, units)
    robot = robot.with_limits(position, **_overrides(scenario.limits, names, units))
    limits = {kind: getattr(robot, f"{kind}_limit") for kind in MAGNITUDES}
    return JointSpace(
        robot.joint_names,
        robot.joint_units,
        robot.lower_position_limit,
        robot.upper_position_limit,
        limits,
        dict(robot.configurations),
        robot,
    )


def _bare_joints(scenario: Scenario) -> JointSpace:
    names = scenario.joint_names
    for name in scenario.joint_units:
        if name not in names:
            with scenario.error_context("joint_units", name):
                raise UnknownNameError("joint", name, names)
    units = tuple(scenario.joint_units.get(name, "rad") for name in names)
    none = np.full(len(names), np.inf)
    lower, upper = -none, none.copy()
    for name, bounds in _position_overrides(scenario.limits, names, units).items():
        lower[names.index(name)], upper[names.index(name)] = bounds
    limits = {
        kind: np.array([values.get(name, np.inf) for name in names])
        for kind, values in _overrides(scenario.limits, names, units).items()
    }
    return JointSpace(names, units, lower, upper, limits, {})


def _position_overrides(
    limits: LimitOverrides, names: tuple[str, ...], units: tuple[str, ...]
) -> dict[str, tuple[float, float]]:
    if limits.position_lower is None or limits.position_upper is None:
        return {}
    lower = limits.position_lower.by_joint(names, units)
    upper = limits.position_upper.by_joint(names, units)
    return {name: (lower[name], upper[name]) for name in lower}


def _overrides(
    limits: LimitOverrides, names: tuple[str, ...], units: tuple[str, ...]
) -> dict[str, dict[str, float]]:
    given: dict[str, JointValues | None] = {kind: getattr(limits, kind) for kind in MAGNITUDES}
    return {
        kind: values.by_joint(names, units, si=kind == "effort") if values is not None else {}
        for kind, values in given.items()
    }
