"""`PlannedJoints`: names, units, limits, weights and configurations of the joints of a robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray, checked_array
from knotwork.errors import RobotError
from knotwork.errors.old_names import OldAttribute
from knotwork.joint_quantities import JointLimits
from knotwork.robot.robot_spec import RobotSpec


class PlannedJoints:
    """The joints of a chain: those of the URDF, base first, then virtual ones.

    Args:
        spec: All data of the robot.
        names: Names of the planned joints of the URDF.
    """

    lower_position_limit = OldAttribute("limits.lower")
    upper_position_limit = OldAttribute("limits.upper")
    velocity_limit = OldAttribute("limits.velocity")
    acceleration_limit = OldAttribute("limits.acceleration")
    jerk_limit = OldAttribute("limits.jerk")
    effort_limit = OldAttribute("limits.effort")

    def __init__(self, spec: RobotSpec, names: Sequence[str]) -> None:
        virtual = spec.virtual_joints
        types = spec.urdf.types
        units = ("m" if types[name] == "prismatic" else "rad" for name in names)
        self._spec = spec
        self.name = spec.name
        self.joint_names = (*names, *(joint.name for joint in virtual))
        self.joint_units = (*units, *(joint.unit for joint in virtual))
        self.dof = len(self.joint_names)
        self.virtual_joints = virtual
        self.is_virtual = np.array([False] * len(names) + [True] * len(virtual))
        self.limits = _collect_limits(spec, names)
        weights = [spec.weights.get(name, 1.0) for name in self.joint_names]
        self.weights = checked_array(weights, (self.dof,), "weights")
        self.configurations: Mapping[str, FloatArray] = MappingProxyType(
            {
                key: checked_array(
                    [*(values[joint] for joint in names), *[0.0] * len(virtual)], (self.dof,), key
                )
                for key, values in spec.configurations.items()
                if all(joint in values for joint in names)
            }
        )

    def configuration(self, name: str) -> FloatArray:
        """A named configuration [rad or m], shape (d,).

        Raises:
            UnknownNameError: No configuration has this name.
            RobotError: The configuration has no position for a joint of the chain.
        """
        positions = self._spec.configuration(name)
        if name not in self.configurations:
            missing = next(joint for joint in self.joint_names if joint not in positions)
            raise RobotError(
                self.name,
                f"configuration {name!r} gives no position for joint {missing!r}",
                joint=missing,
            )
        return self.configurations[name]


def _collect_limits(spec: RobotSpec, names: Sequence[str]) -> JointLimits:
    """Collect the limits of a chain's joints.

    A velocity or effort limit of zero in the URDF means that it is not given. Virtual joints have
    only position limits. Without a tool frame no pose is planned, so no joint needs a range.

    Raises:
        RobotError: A joint's position limits have no range.
    """
    types = spec.urdf.types
    model = spec.urdf.model
    ranges = {joint.name: (joint.lower, joint.upper) for joint in spec.virtual_joints}
    tables: dict[str, dict[str, Any]] = {"position": ranges, "velocity": {}, "effort": {}}
    for name in names:
        joint = model.joints[model.getJointId(name)]
        if types[name] != "continuous":
            lower, upper = model.lowerPositionLimit, model.upperPositionLimit
            ranges[name] = lower[joint.idx_q], upper[joint.idx_q]
        for kind, limits in (("velocity", model.velocityLimit), ("effort", model.effortLimit)):
            if limits[joint.idx_v] > 0:
                tables[kind][name] = limits[joint.idx_v]
    for kind, table in spec.limits.items():
        tables[kind] = {**tables.get(kind, {}), **table}
    if spec.world_frame is not None:  # efforts are unknown where the base moves
        tables["effort"] = {}
    for name in names:
        lower, upper = tables["position"].get(name, (-np.inf, np.inf))
        if lower > upper or (lower == upper and spec.tool_frame is not None):
            raise RobotError(
                spec.name,
                f"position limits of joint {name!r} are [{lower:g}, {upper:g}], which leaves "
                "it no range; give others under "
                f"`limits: {{position: {{{name}: [lower, upper]}}}}` or lock it with "
                f"`locked: {{{name}: {lower:g}}}`",
                joint=name,
            )
    joint_names = (*names, *(joint.name for joint in spec.virtual_joints))
    return JointLimits.by_joint(joint_names, tables).scaled(spec.used_fraction)
