"""Joint limits: those of the URDF, replaced where a description or a scenario gives others."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from knotwork.errors import RobotError, UnknownNameError
from knotwork.joint_quantities import MAGNITUDES
from knotwork.robot.urdf import Urdf
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class LimitTables:
    """Limits that replace those of the URDF: joint to value, SI units.

    Attributes:
        position: Lower and upper limit of a joint [rad or m].
        rates: For each of `MAGNITUDES`, joint to magnitude; a plain number is for all joints.
    """

    position: Mapping[str, Sequence[float]] = field(default_factory=dict)
    rates: Mapping[str, float | Mapping[str, float]] = field(default_factory=dict)

    def merged(self, position: Mapping[str, Any], rates: Mapping[str, Any]) -> LimitTables:
        """Replace those limits that are given anew."""
        known: dict[str, float | Mapping[str, float]] = dict(self.rates)
        for kind, new in rates.items():
            old = known.get(kind, {})
            if isinstance(new, Mapping):
                everyone = {"": old} if not isinstance(old, Mapping) else old
                known[kind] = {**everyone, **new}
            else:
                known[kind] = new
        return LimitTables({**self.position, **position}, known)


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of the joints of a chain, read-only, shape (d,) each; infinite where there is none."""

    lower_position: FloatArray
    upper_position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    effort: FloatArray


def check_tables(tables: LimitTables, joints: Sequence[str], robot: str) -> None:
    """Check that each joint exists and each value can be a limit.

    Raises:
        UnknownNameError: There is no such joint.
        RobotError: A magnitude isn't positive or an interval is empty.
    """
    for joint, interval in tables.position.items():
        _known(joint, joints, f"robot {robot!r}: limits.position")
        bounds = tuple(_number(value, robot, f"position limit of {joint!r}") for value in interval)
        if len(bounds) != 2 or not bounds[0] < bounds[1]:
            raise RobotError(
                robot,
                f"position limits of joint {joint!r} are {list(bounds)}; give [lower, upper] with "
                "lower < upper",
                joint=joint,
            )
    for kind, table in tables.rates.items():
        values = table if isinstance(table, Mapping) else {"": table}
        for joint, value in values.items():
            if joint:
                _known(joint, joints, f"robot {robot!r}: limits.{kind}")
            what = f"{kind} limit of {joint!r}" if joint else f"{kind} limit"
            if not _number(value, robot, what) > 0:
                raise RobotError(robot, f"{what} is {value!r}; it must be positive", joint=joint)


def _known(joint: str, joints: Sequence[str], where: str) -> None:
    if joint not in joints:
        raise UnknownNameError("joint", str(joint), joints, where=where)


def _number(value: Any, robot: str, what: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise RobotError(robot, f"{what} must be a number, not {value!r}") from error
    if math.isnan(number):
        raise RobotError(robot, f"{what} must be a number, not nan")
    return number


def chain_limits(
    urdf: Urdf, tables: LimitTables, joints: Sequence[str], robot: str, *, planned: bool
) -> Limits:
    """Collect the limits of a chain's joints.

    A velocity or effort of zero in the URDF means that none is given there.

    Args:
        urdf: The whole model.
        tables: What replaces the URDF's limits.
        joints: The chain's joints.
        robot: Name of the robot, for errors.
        planned: Whether the joints are to be planned for, so that each must be able to move.

    Raises:
        RobotError: A joint's position limits leave it no room.
    """
    full = urdf.model
    lower, upper = np.full(len(joints), -np.inf), np.full(len(joints), np.inf)
    rates = {kind: np.full(len(joints), np.inf) for kind in MAGNITUDES}
    for i, name in enumerate(joints):
        joint = full.joints[full.getJointId(name)]
        if name in tables.position:
            lower[i], upper[i] = tables.position[name]
        elif name not in urdf.unbounded:
            lower[i] = full.lowerPositionLimit[joint.idx_q]
            upper[i] = full.upperPositionLimit[joint.idx_q]
        if planned and not lower[i] < upper[i]:
            raise RobotError(
                robot,
                f"position limits of joint {name!r} are [{lower[i]:g}, {upper[i]:g}], which "
                f"leaves it no room; give others under `limits: {{position: {{{name}: [lower, "
                f"upper]}}}}` or lock it with `locked: {{{name}: {lower[i]:g}}}`",
                joint=name,
            )
        given = {
            "velocity": full.velocityLimit[joint.idx_v],
            "effort": full.effortLimit[joint.idx_v],
        }
        for kind, array in rates.items():
            table = tables.rates.get(kind, {})
            if not isinstance(table, Mapping):
                array[i] = table
            elif name in table or "" in table:
                array[i] = table.get(name, table.get("", np.inf))
            elif given.get(kind, 0.0) > 0:
                array[i] = given[kind]
    for array in (lower, upper, *rates.values()):
        array.setflags(write=False)
    return Limits(lower, upper, **rates)
