"""A motion with its scenario and check, for pictures and scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.tool_paths.task_frame import TaskFrame
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.errors.plain_text import default_waypoint_name
from knotwork.joint_quantities import MOTION_QUANTITIES, JointLimits
from knotwork.robot import Robot
from knotwork.scene.collision_model import CollisionModel, find_carrier
from knotwork.task import ExpandedTask
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_reader import JointState
from knotwork.task.scenario.scenario_joints import ScenarioJoints, read_scenario_joints
from knotwork.units import Units
from knotwork.verification import Finding, Motion, Report
from knotwork.verification.brief import worst_failure_text
from knotwork.verification.collisions import collision_model_of
from knotwork.verification.finding import unite_intervals
from knotwork.verification.limits import LIMIT_GROUPS, check_derivative_limits
from knotwork.verification.report import CheckedMotion
from knotwork.view.links import LinkShapes, link_shapes
from knotwork.waypoints import JointWaypoints

CACHED_MOTIONS = 4
"""Number of motions whose tool trace is cached: two side by side, before and after a change."""


@dataclass(frozen=True, eq=False)
class ShownMotion:
    """A motion with its scenario and check.

    Attributes:
        trajectory: The motion, joints in the order of `joints`.
        scenario: The scenario; for a motion without one, it has no waypoints.
        joints: The joints with their limits, and their robot.
        report: Report of the check, if there was one.
        joint_waypoints: Joint values at the waypoints, if known.
        label: Name of the motion in a picture.
    """

    trajectory: JointTrajectory
    scenario: Scenario
    joints: ScenarioJoints
    report: Report | None = None
    joint_waypoints: JointWaypoints | None = None
    label: str = "trajectory"

    @classmethod
    def of_checked(cls, motion: CheckedMotion) -> ShownMotion:
        """A motion with its report and joint values at the waypoints."""
        shown = cls.of_trajectory(motion.trajectory, motion.scenario, motion.joints)
        return replace(shown, report=motion.report, joint_waypoints=motion.joint_waypoints)

    @classmethod
    def of_trajectory(
        cls,
        trajectory: JointTrajectory,
        scenario: Scenario,
        joints: ScenarioJoints | None = None,
    ) -> ShownMotion:
        """The motion of a trajectory, with its scenario.

        Raises:
            InputError: Its joints are not those of the scenario.
        """
        joints = joints or read_scenario_joints(scenario)
        ordered = trajectory.reordered(joints.joint_names, joints.joint_units)
        return cls(ordered, scenario, joints, label=trajectory.origin or "trajectory")

    @classmethod
    def of_robot(cls, trajectory: JointTrajectory, robot: Robot) -> ShownMotion:
        """A stored motion of a robot.

        Raises:
            InputError: Its joints are not the robot's.
        """
        names, units = robot.joint_names, robot.joint_units
        ordered = trajectory.reordered(names, units, owner=f"robot {robot.name!r}")
        joints = ScenarioJoints(names, units, robot.limits, robot=robot)
        return cls(ordered, scenario_without_waypoints(f"{robot.name}: stored trajectory"), joints)

    @classmethod
    def of_joints(cls, trajectory: JointTrajectory) -> ShownMotion:
        """A motion of joints without known limits."""
        names, units = trajectory.joint_names, trajectory.joint_units
        joints = ScenarioJoints(names, units, JointLimits(np.full(len(names), np.inf)))
        return cls.of_trajectory(trajectory, scenario_without_waypoints(""), joints)

    @property
    def robot(self) -> Robot:
        """The arm.

        Raises:
            InputError: The scenario has no robot.
        """
        if self.joints.robot is None:
            raise InputError(
                f"scenario {self.scenario.name!r} names no robot, so there is no arm to show; name "
                "one in the scenario, or draw plots of its joints"
            )
        return self.joints.robot

    @property
    def curve(self) -> PiecewisePolynomial:
        """Joint positions over time."""
        return self.trajectory.polynomial

    @property
    def findings(self) -> Sequence[Finding]:
        """Findings of the check."""
        return self.report.findings if self.report is not None else ()

    @property
    def failures(self) -> Sequence[Finding]:
        """Failures of the check."""
        return self.report.failures if self.report is not None else ()

    @property
    def failure_text(self) -> str:
        """The worst failure in one line, or an empty text."""
        return worst_failure_text(self.failures, self.scenario.units)

    @cached_property
    def joint_limit_findings(self) -> dict[tuple[str, str], Finding]:
        """Findings on limits of joints, by joint and quantity."""
        findings = self.findings or tuple(check_derivative_limits(self.joints, self.curve))
        return {
            (finding.name, finding.quantity): finding
            for finding in findings
            if finding.subject == "joint" and finding.quantity in MOTION_QUANTITIES
            if finding.limit is not None
        }

    @property
    def tool_findings(self) -> tuple[Finding, ...]:
        """Findings on limits of tool and links, and on the nearest surroundings."""
        limits = [finding for finding in self.findings if finding.group in LIMIT_GROUPS]
        nearest = nearest_around(self.findings)
        return (
            *(finding for finding in limits if finding.subject != "joint"),
            *([] if nearest is None else [nearest]),
        )

    @property
    def contacts(self) -> list[tuple[float, float]]:
        """Time intervals of contacts [s]."""
        contacts = (failure for failure in self.failures if failure.bodies)
        return list(unite_intervals(span for contact in contacts for span in contact.intervals))

    def units(self, degrees: bool | None) -> Units:
        """Units of the scenario; `degrees` selects another unit of angles."""
        units = self.scenario.units
        return units if degrees is None else replace(units, angle="deg" if degrees else "rad")

    def bounds(self, joint: str, quantity: str) -> tuple[float, float]:
        """Lower and upper limit of a quantity of a joint, infinite without a limit."""
        i = self.joints.joint_names.index(joint)
        lower, upper = self.joints.limits.bounds(quantity)
        return float(lower[i]), float(upper[i])

    @property
    def chosen_velocities(self) -> set[str]:
        """Names of waypoints whose velocity was not given, but chosen by planning."""
        return {name for section in self.scenario.task.chosen or () for name in section.velocities}

    @property
    def times(self) -> FloatArray:
        """Times of the waypoints, for a stored trajectory those in its file [s], shape (n,)."""
        known = self.scenario.waypoints or self.trajectory.waypoint_times is None
        return self.scenario.times if known else np.asarray(self.trajectory.waypoint_times)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the waypoints, by default `"waypoint 1"` and so on, length n."""
        named = tuple(waypoint.name for waypoint in self.scenario.waypoints)
        return named or tuple(map(default_waypoint_name, range(len(self.times))))

    @cached_property
    def given_values(self) -> tuple[FloatArray, FloatArray]:
        """Given joint positions and velocities at the waypoints, each of shape (n, d).

        Values that are not known, and velocities that planning chose, are NaN. Without a plan the
        joint values of poses are unknown.
        """
        joints = self.trajectory.joint_names
        waypoints = self.joint_waypoints
        if waypoints is not None:
            order = [waypoints.joint_names.index(name) for name in joints]
            rows = list(waypoints.waypoint_rows)
            chosen = np.isin(self.names, list(self.chosen_velocities))[:, np.newaxis]
            velocity = np.where(chosen, np.nan, waypoints.velocity[rows][:, order])
            return waypoints.position[rows][:, order], velocity
        nan = np.full(len(joints), np.nan)
        targets = self.joints.targets or (None,) * len(self.times)
        states = np.array([target or JointState(nan, nan) for target in targets])
        position, velocity = states.reshape(-1, 2, len(joints)).swapaxes(0, 1)
        return position, velocity

    @cached_property
    def shapes(self) -> LinkShapes:
        """The meshes of the links."""
        return link_shapes(self.robot)

    @cached_property
    def collision_model(self) -> CollisionModel | None:
        """The collision model, if obstacles move.

        Raises:
            InputError: A mesh, or another robot's scenario, is wrong.
        """
        scene, link = self.scenario.scene, self.scenario.pose_frame_link
        frames = [*scene.frames.values(), *(item.frame for item in scene.objects)]
        frames += [frame for held in scene.held for frame in held.end_frames]
        if not scene.robots and all(frame.rests_on(link) for frame in frames):
            return None
        return collision_model_of(Motion(self.trajectory, self.joints), self.scenario, self.robot)

    @property
    def root_carrier(self) -> tuple[None, Any]:
        """The carrier of fixed frames: no joint, and the base frame in axes of the URDF's root."""
        return None, self.robot.base_placement

    def carrier_of(self, frame: TaskFrame, time: float | None = None) -> tuple[int | None, Any]:
        """The joint that carries a frame, and the transform from base axes to the joint's.

        The frame is at rest, or where it is at a time [s]. If it is fixed relative to the URDF's
        root, the result is `root_carrier`.
        """
        if self.collision_model is None:
            return self.root_carrier
        joint, placement = find_carrier(self.collision_model.carriers, frame, time)
        return joint or None, placement


def scenario_without_waypoints(name: str) -> Scenario:
    """Make a scenario for a motion that has none; unlike all others, it has no waypoints."""
    task = ExpandedTask.model_construct(waypoints=())
    return Scenario(name, (), task, task.planner, task.tolerances)


def nearest_around(findings: Sequence[Finding]) -> Finding | None:
    """The finding on the pair of robot and surroundings with the smallest gap."""
    pairs = [pair for pair in findings if pair.involves_scene]
    return min(pairs, key=lambda pair: (pair.value or 0.0) - (pair.limit or 0.0), default=None)
