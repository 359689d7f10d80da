"""Joint values of a task, from the units of its file to SI."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.joint_quantities import JOINT_QUANTITIES, MOTION_QUANTITIES
from knotwork.task import ChosenSectionFields, JointWaypoint, PoseWaypoint
from knotwork.task.scenario import JointTarget
from knotwork.task.scenario.scenario import Scenario
from knotwork.waypoints import CartesianWaypoint, ChosenSection

STATE_TOLERANCE = 1e-12
"""Distance within which poses and joint positions are equal [m, rad]."""


class JointState(NamedTuple):
    """Joint values required at a waypoint.

    Attributes:
        position: Joint positions [rad or m], shape (d,).
        velocity: Joint velocities [rad/s or m/s], shape (d,).
    """

    position: FloatArray
    velocity: FloatArray


@dataclass(frozen=True)
class JointReader:
    """Reader of the joint values of a task, in SI."""

    scenario: Scenario
    names: tuple[str, ...]
    units: tuple[str, ...]
    configurations: Mapping[str, FloatArray] = field(default_factory=dict)

    def by_joint(self, values: Any, *location: str | int) -> Mapping[str, Any]:
        """Values by joint, as given; a single one is that of every joint."""
        if not isinstance(values, Mapping):
            return dict.fromkeys(self.names, float(values))
        for name in values:
            self.scenario.locations.check_name((*location, name), "joint", name, self.names)
        return values

    def to_si(self, values: Any, *location: str | int) -> dict[str, Any]:
        """Values by joint [rad or m, and per second]."""
        length, angle = self.scenario.task.units.in_si
        units = dict(zip(self.names, self.units, strict=True))
        return {
            name: np.multiply(value, angle if units[name] == "rad" else length).tolist()
            for name, value in self.by_joint(values, *location).items()
        }

    def array(self, values: Any, *location: str | int, missing: float | None = None) -> FloatArray:
        """A value for every joint, shape (d,), or a list, (d, m); `missing` for joints left out."""
        if isinstance(values, str):
            locations = self.scenario.locations
            locations.check_name(location, "configuration", values, self.configurations)
            return np.array(self.configurations[values])
        values = self.to_si(values, *location)
        absent = [name for name in self.names if name not in values]
        if absent and missing is None:
            raise self.scenario.locations.error(
                location,
                f"gives no value for joint {', '.join(absent)}",
                f"a value for each of {', '.join(self.names)}",
            )
        return np.array([values.get(name, missing or 0.0) for name in self.names])

    def limits(self) -> dict[str, Mapping[str, Any]]:
        """Limits by quantity and joint in SI, as those of effort are given; of position, pairs."""
        limits: dict[str, Mapping[str, Any]] = {}
        for kind in JOINT_QUANTITIES:
            values = getattr(self.scenario.task.limits, kind)
            if values is not None:
                read = self.to_si if kind in MOTION_QUANTITIES else self.by_joint
                limits[kind] = read(values, "limits", kind)
        return limits

    def targets(self) -> tuple[JointState | None, ...]:
        """Required joint values at each waypoint; `None` for a pose."""
        return tuple(map(self._target, self.scenario.task_index))

    def accelerations(self) -> str | FloatArray | None:
        """The planner option of this name; values have shape (n, d)."""
        accelerations = self.scenario.task.planner_options.accelerations
        if accelerations is None or isinstance(accelerations, str):
            return accelerations
        location = "planner_options", "accelerations"
        return np.array([self.array(row, *location, i) for i, row in enumerate(accelerations)])

    def near_at_waypoints(self) -> dict[int, FloatArray]:
        """Joint positions near which solutions are chosen, shape (d,), by index of the waypoint."""
        result = {}
        for i, task_i in enumerate(self.scenario.task_index):
            waypoint = self.scenario.task.waypoints[task_i] if task_i >= 0 else None
            if isinstance(waypoint, PoseWaypoint) and waypoint.near is not None:
                result[i] = self.array(waypoint.near, "waypoints", task_i, "near")
        return result

    def chosen_sections(self) -> tuple[ChosenSection, ...] | None:
        """Sections of waypoints with a chosen motion, or `None`."""
        motions = self.scenario.task.chosen or ()
        return tuple(self._chosen_section(motion, i) for i, motion in enumerate(motions)) or None

    def _chosen_section(self, motion: ChosenSectionFields, i: int) -> ChosenSection:
        names = [waypoint.name for waypoint in self.scenario.waypoints]
        location = "chosen", i
        for name in motion.velocities:
            field = *location, "velocities", name
            self.scenario.locations.check_name(field, "waypoint", name, names)
        return ChosenSection(
            np.array(motion.times),
            self.array(motion.accelerations, *location, "accelerations").T,
            {
                names.index(name): self.array(values, *location, "velocities", name)
                for name, values in motion.velocities.items()
            },
        )

    def tolerance(self, quantity: str) -> FloatArray:
        """Tolerance of a quantity of the joints, shape (d,)."""
        name = f"joint_{quantity}"
        tolerances = self.scenario.task.tolerances
        value = getattr(tolerances, name)
        if name not in tolerances.model_fields_set:  # the default is in SI
            return np.full(len(self.names), value)
        return np.array([*self.to_si(value, "tolerances", name).values()])

    def end_acceleration(self) -> tuple[FloatArray, FloatArray] | None:
        """Required accelerations at the start and at the end, shape (d,) each, or `None`."""
        ends = self.scenario.task.end_acceleration
        if ends is None:
            return None
        accelerations = ({}, {}) if isinstance(ends, str) else (ends.start, ends.end)
        location = "end_acceleration"
        start = self.array(accelerations[0], location, "start", missing=0.0)
        return start, self.array(accelerations[1], location, "end", missing=0.0)

    def _target(self, task_i: int) -> JointState | None:
        task = self.scenario.task
        if task_i < 0:
            return JointState(self.array(task.start, "start"), np.zeros(len(self.names)))
        location = "waypoints", task_i
        waypoint = task.waypoints[task_i]
        if not isinstance(waypoint, JointWaypoint):
            return None
        position = self.array(waypoint.joints, *location, "joints")
        velocity = waypoint.velocity if isinstance(waypoint.velocity, dict) else {}
        return JointState(position, self.array(velocity, *location, "velocity", missing=0.0))


def find_rest_intervals(scenario: Scenario, targets: Sequence[JointState | None]) -> Iterator[int]:
    """Find the intervals between equal waypoints at rest without a tool path: waits, for example.

    Args:
        scenario: The scenario.
        targets: Required joint values at its waypoints; `None` for a pose.
    """
    moved = {i for path in scenario.paths for i in range(path.first, path.last)}
    if scenario.unknowns is not None:  # a chosen velocity is not a stop
        given = [waypoint.velocity_kind == "given" for waypoint in scenario.unknowns.at_waypoints]
        moved |= {i for i, both in enumerate(pairwise(given)) if not all(both)}
    states = [
        _state_at_rest(waypoint, target)
        for waypoint, target in zip(scenario.waypoints, targets, strict=True)
    ]
    in_world = [waypoint.in_world_frame for waypoint in scenario.waypoints]
    for i, (first, second) in enumerate(pairwise(states)):
        if in_world[i] != in_world[i + 1]:
            continue
        if i in moved or first is None or second is None or first.shape != second.shape:
            continue
        if np.abs(first - second).max() <= STATE_TOLERANCE:
            yield i


def _state_at_rest(
    waypoint: CartesianWaypoint | JointTarget, target: JointState | None
) -> FloatArray | None:
    """Pose or joint positions of a waypoint; `None` where it moves."""
    if isinstance(waypoint, CartesianWaypoint):
        return None if waypoint.twist.vector.any() else waypoint.pose.homogeneous
    return None if target is None or target.velocity.any() else target.position
