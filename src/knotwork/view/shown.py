"""`Shown`: a motion of an arm with its task and check, for a scene."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.scene.collision_model import CollisionModel
from knotwork.trajectory import JointTrajectory
from knotwork.verification import Finding, Report, check
from knotwork.verification.checked_motion import Motion
from knotwork.verification.collisions import motion_model
from knotwork.view.drawn_motions import asking_nothing, chosen_velocities
from knotwork.view.footing import footing
from knotwork.view.links import LinkShapes, link_shapes
from knotwork.view.targets import targets
from knotwork.view.tool_trace import ToolTrace, tool_trace
from knotwork.waypoints import CartesianWaypoint, FloatArray


class Shown:
    """The motion of a scene.

    Attributes:
        robot: The arm.
        trajectory: Its motion, joints in the robot's order.
        scenario: The task; for a stored motion one without requirements.
        space: Its joints and limits.
        report: Report of the check, if there was one.
        fastest: Lower bound on the end of the scale of tool speeds [m/s].
    """

    def __init__(
        self,
        robot: Robot,
        trajectory: JointTrajectory,
        scenario: Scenario | None = None,
        space: JointSpace | None = None,
        report: Report | None = None,
        fastest: float = 0.0,
    ) -> None:
        self.robot, self.report, self.fastest = robot, report, fastest
        self.trajectory = self.in_order(trajectory)
        self.scenario = scenario or asking_nothing(f"{robot.name}: stored trajectory")
        self.space = space or JointSpace(
            robot.joint_names,
            robot.joint_units,
            robot.lower_position_limit,
            robot.upper_position_limit,
            robot.limits,
            robot=robot,
        )

    def in_order(self, trajectory: JointTrajectory) -> JointTrajectory:
        """A motion with its joints in the robot's order.

        Raises:
            InputError: Its joints are not the robot's.
        """
        names, units = self.robot.joint_names, self.robot.joint_units
        return trajectory.reordered(names, units, owner=f"robot {self.robot.name!r}")

    def judged(self, trajectory: JointTrajectory) -> Report:
        """The check of another motion for the same task."""
        return check(trajectory, self.scenario, space=self.space)

    @property
    def curve(self) -> PiecewisePolynomial:
        """Joint positions, joints in the robot's order."""
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
    def times(self) -> FloatArray:
        """Times of the waypoints, for a stored trajectory its own ones [s], shape (n,)."""
        known = self.scenario.waypoints or self.trajectory.waypoint_times is None
        return self.scenario.times if known else np.asarray(self.trajectory.waypoint_times)

    @cached_property
    def shapes(self) -> LinkShapes:
        """The meshes of the links."""
        return link_shapes(self.robot)

    @cached_property
    def asked(self) -> Sequence[CartesianWaypoint]:
        """The waypoints at the tool."""
        has_tool = self.robot.tcp_frame_id is not None
        return targets(self.scenario, self.space, self.robot, self.curve) if has_tool else ()

    @property
    def given(self) -> Sequence[CartesianWaypoint]:
        """The waypoints whose velocity was given, not chosen by planning."""
        chosen = chosen_velocities(self.scenario)
        return [one for one in self.asked if one.name not in chosen]

    @cached_property
    def path(self) -> ToolTrace | None:
        """The path of the tool; `None` without a tool."""
        if self.robot.tcp_frame_id is None:
            return None
        times = [target.time for target in self.asked]
        paths = self.scenario.paths
        return tool_trace(self.robot, self.curve, self.space, self.failures, times, paths)

    @cached_property
    def model(self) -> CollisionModel | None:
        """The collision model, if obstacles move.

        Raises:
            InputError: A mesh, or another robot's scenario, is wrong.
        """
        scene = self.scenario.scene
        riding = any(one.carrier is not None for one in scene.objects)
        if not (scene.robots or scene.moving or riding):
            return None
        return motion_model(Motion(self.trajectory, self.space), self.scenario, self.robot)

    def carrying(self, frame: Any, time: float | None = None) -> tuple[int | None, Any]:
        """The joint that carries a moving frame, and the transform of base poses into its axes.

        The frame is at rest, or at a time [s]. Without a frame, or without moving obstacles, it
        is the URDF's root: `None`.
        """
        if self.model is None or frame is None:
            return None, self.robot.base_placement
        return self.model.joint_of_frame(frame, time)

    def at_start(self, points: FloatArray) -> FloatArray:
        """Points carried by the base frame at the start of the motion, shape (n, 3)."""
        start = self.curve(self.curve.x[:1])
        return np.asarray(footing(self.robot).in_cell(start, points[None])[0])
