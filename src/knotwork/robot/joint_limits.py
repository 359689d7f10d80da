"""Joint limits of the URDF, overridden by a description or a scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from knotwork.errors import RobotError, UnknownNameError
from knotwork.joint_quantities import JOINT_QUANTITIES, MAGNITUDES
from knotwork.robot.urdf import Urdf
from knotwork.waypoints import FloatArray

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


def collect_limits(
    urdf: Urdf,
    tables: LimitTables,
    joints: Sequence[str],
    robot: str,
    *,
    planned: bool,
    virtual: Sequence[tuple[float, float]] = (),
    has_efforts: bool = True,
) -> tuple[FloatArray, FloatArray, dict[str, FloatArray]]:
    """Collect the limits of a chain's joints.

    A velocity or effort limit of zero in the URDF means that it is not given.

    Args:
        urdf: The whole model.
        tables: Limits that override the URDF's.
        joints: The chain's joints.
        robot: Name of the robot, for errors.
        planned: Whether the joints are planned, so that each must have a range.
        virtual: Lower and upper limits of further joints, which have no other limits.
        has_efforts: Whether efforts are known; otherwise they have no limits.

    Returns:
        Lower and upper limits of position, and magnitudes by quantity: read-only arrays of shape
        (d,), infinite where there is no limit.

    Raises:
        RobotError: A joint's position limits have no range.
    """
    full = urdf.model
    from_urdf = {"velocity": full.velocityLimit, "effort": full.effortLimit}
    position = np.array([[-np.inf], [np.inf]]).repeat(len(joints), axis=1)
    magnitudes = {kind: np.full(len(joints), np.inf) for kind in MAGNITUDES}
    for i, name in enumerate(joints):
        joint = full.joints[full.getJointId(name)]
        if name in tables.get("position", {}):
            position[:, i] = tables["position"][name]
        elif name not in urdf.unbounded:
            position[0, i] = full.lowerPositionLimit[joint.idx_q]
            position[1, i] = full.upperPositionLimit[joint.idx_q]
        lower, upper = position[:, i]
        if planned and not lower < upper:
            raise _empty_range_error(robot, name, lower, upper)
        for kind, array in magnitudes.items():
            if name in tables.get(kind, {}):
                array[i] = tables[kind][name]
            elif kind in from_urdf and from_urdf[kind][joint.idx_v] > 0:
                array[i] = from_urdf[kind][joint.idx_v]
    if not has_efforts:
        magnitudes["effort"][:] = np.inf
    endless = np.full(len(virtual), np.inf)
    position = np.hstack((position, np.reshape(virtual, (-1, 2)).T))
    magnitudes = {kind: np.append(values, endless) for kind, values in magnitudes.items()}
    for array in (position, *magnitudes.values()):
        array.setflags(write=False)
    return position[0], position[1], magnitudes


def _empty_range_error(robot: str, joint: str, lower: float, upper: float) -> RobotError:
    return RobotError(
        robot,
        f"position limits of joint {joint!r} are [{lower:g}, {upper:g}], which leaves it no range; "
        f"give others under `limits: {{position: {{{joint}: [lower, upper]}}}}` or lock it with "
        f"`locked: {{{joint}: {lower:g}}}`",
        joint=joint,
    )
