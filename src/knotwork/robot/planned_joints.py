"""`PlannedJoints`: names, units, limits, weights and configurations of the joints of a chain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from knotwork.errors import RobotError, UnknownNameError
from knotwork.robot.description import Description
from knotwork.robot.joint_limits import collect_limits
from knotwork.waypoints import FloatArray, read_only


class PlannedJoints:
    """The joints of a chain: those of the URDF, base first, then virtual ones.

    Args:
        description: The robot.
        names: Names of the planned joints of the URDF.

    Attributes:
        names: Names of the d joints.
        units: `"rad"` or `"m"` for each joint.
        virtual: Whether each joint is a virtual one, shape (d,).
        lower, upper: Position limits [rad or m], shape (d,).
        limits: Other limits by name of the quantity, shape (d,).
        weights: Weight of each joint's motion, shape (d,).
        configurations: Named configurations with all joints [rad or m], shape (d,).
    """

    def __init__(self, description: Description, names: Sequence[str]) -> None:
        types, extra = description.urdf.types, description.virtual
        units = ("m" if types[name] == "prismatic" else "rad" for name in names)
        self._description = description
        self.names = (*names, *(joint.name for joint in extra))
        self.units = (*units, *(joint.unit for joint in extra))
        self.virtual = np.array([False] * len(names) + [True] * len(extra))
        self.lower, self.upper, limits = collect_limits(
            description.urdf,
            description.limits,
            names,
            description.name,
            planned=description.tool_frame is not None,
            virtual=[(joint.lower, joint.upper) for joint in extra],
            has_efforts=description.world_frame is None,
        )
        self.limits = MappingProxyType(limits)
        weights = [description.weights.get(name, 1.0) for name in self.names]
        self.weights = read_only(weights, (len(weights),), "weights")
        self.configurations: Mapping[str, FloatArray] = MappingProxyType(
            {
                key: self._complete(key, [values[joint] for joint in names])
                for key, values in description.configurations.items()
                if all(joint in values for joint in names)
            }
        )

    def _complete(self, name: str, values: Sequence[float]) -> FloatArray:
        """A configuration with virtual joints at 0."""
        virtual = [0.0] * (len(self.names) - len(values))
        return read_only([*values, *virtual], (len(self.names),), name)

    def configuration(self, name: str) -> FloatArray:
        """A named configuration; see `Robot.configuration`."""
        description = self._description
        known = description.configurations
        if name not in known:
            where = f"robot {description.name!r}"
            raise UnknownNameError("configuration", name, known, where=where)
        if name not in self.configurations:
            missing = next(joint for joint in self.names if joint not in known[name])
            raise RobotError(
                description.name,
                f"configuration {name!r} gives no position for joint {missing!r}",
                joint=missing,
            )
        return self.configurations[name]
