"""Joint limits that a description or a scenario gives in place of those of the URDF."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from knotwork.errors import RobotError, UnknownNameError
from knotwork.joint_quantities import JOINT_QUANTITIES
from knotwork.robot.urdf import Urdf

# Limits that override the URDF's: by quantity and joint, in SI; a pair for "position".
LimitTables = Mapping[str, Mapping[str, Any]]


def expand_limits(
    limits: Mapping[str, Any], joints: Sequence[str], urdf: Urdf, robot: str
) -> LimitTables:
    """Check limits, and expand a number to all joints of the URDF.

    Args:
        limits: Quantity to joint to limit, to a number for all joints, or to `None`.
        joints: Names of the joints.
        urdf: The whole model.
        robot: Name of the robot, for errors.

    Raises:
        UnknownNameError: The robot has no such joint, or no such quantity exists.
        RobotError: A magnitude isn't positive or an interval is empty.
    """
    tables: dict[str, Mapping[str, Any]] = {}
    for kind, table in limits.items():
        if kind not in JOINT_QUANTITIES:
            raise UnknownNameError("limit", kind, JOINT_QUANTITIES, where=f"robot {robot!r}")
        if isinstance(table, Mapping):
            for joint, value in table.items():
                if joint not in joints:
                    where = f"robot {robot!r}: limits.{kind}"
                    raise UnknownNameError("joint", str(joint), joints, where=where)
                _check_limit(kind, value, robot, joint)
            tables[kind] = table
        elif table is not None:
            _check_limit(kind, table, robot)
            tables[kind] = dict.fromkeys(urdf.types, table)
    return tables


def _check_limit(kind: str, value: Any, robot: str, joint: str | None = None) -> None:
    try:
        numbers = np.array(value, dtype=float)
    except (TypeError, ValueError):
        numbers = np.array(np.nan)
    if JOINT_QUANTITIES[kind].limit == "range":
        accepted = "give [lower, upper] with lower < upper"
        fine = numbers.shape == (2,) and numbers[0] < numbers[1]
    else:
        accepted = "it must be a positive number"
        fine = numbers.shape == () and numbers > 0.0
    if not fine:
        name = f"{kind} limit of {joint!r}" if joint is not None else f"{kind} limit"
        raise RobotError(robot, f"{name} is {value!r}; {accepted}", joint=joint)
