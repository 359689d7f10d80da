"""`SolvedScenario`: a scenario with its joints and the IK solutions of its poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import IndexArray
from knotwork.planning.task_to_joint import TaskSolution, knots_of, solve_task
from knotwork.task import Weights
from knotwork.task.scenario import Scenario, ScenarioUnknowns, WaypointUnknowns
from knotwork.task.scenario.scenario_joints import ScenarioJoints, read_scenario_joints
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.planning.timing import Dynamics
    from knotwork.scene.collision_model import CollisionModel


@dataclass(frozen=True, eq=False)
class SolvedScenario:
    """A scenario with unknowns, its joints and the IK solutions of its poses.

    Timing problems need joint positions, loads and bodies, which the scenario alone does not have.

    Attributes:
        scenario: The scenario.
        joints: Its joints.
        solution: Its waypoints at the joints, unknown times as expected.
        original_scenario: The scenario before any value was chosen.
    """

    scenario: Scenario
    joints: ScenarioJoints
    solution: TaskSolution
    original_scenario: Scenario

    @classmethod
    def solve(cls, scenario: Scenario, earlier: SolvedScenario | None = None) -> SolvedScenario:
        """A scenario with its joints and the best solutions of its poses.

        Args:
            scenario: The scenario.
            earlier: The same task with other speeds along its paths; see `solve_task`.
        """
        known, original = (
            (earlier.solution, earlier.original_scenario) if earlier else (None, scenario)
        )
        joints = read_scenario_joints(scenario)
        solution = solve_task(scenario, joints, knots_of(scenario), (), known)
        return cls(scenario, joints, solution, original)

    @property
    def unknowns(self) -> ScenarioUnknowns:
        """Its unknowns; without any after the choice of all speeds along paths."""
        nothing = (WaypointUnknowns(),) * len(self.scenario.waypoints)
        return self.scenario.unknowns or ScenarioUnknowns(nothing, Weights(time=1.0))

    @property
    def joint_waypoints(self) -> JointWaypoints:
        """All waypoints at the joints, including inserted ones along paths."""
        return self.solution.waypoints

    @property
    def rows(self) -> IndexArray:
        """Rows of the scenario's waypoints, shape (n,)."""
        return np.array(self.joint_waypoints.waypoint_rows)

    @cached_property
    def dynamics(self) -> tuple[Dynamics | None, ...]:
        """Dynamics of the robot from each waypoint to the next, one object for equal loads."""
        from knotwork.planning.timing import Dynamics

        if self.joints.loaded_robots is None:
            return (None,) * (len(self.scenario.waypoints) - 1)
        robots = self.joints.loaded_robots.by_interval
        models = {id(robot): Dynamics(robot) for robot in robots}
        return tuple(models[id(robot)] for robot in robots)

    @cached_property
    def split_reasons(self) -> Mapping[int, str]:
        """Reason for each waypoint at which sections are split, by index.

        The acceleration is zero there if none is given. Two collision-free motions are one if only
        a position is given between them.
        """
        waypoints = self.unknowns.at_waypoints
        loads = enumerate(pairwise(self.dynamics), start=1)
        points = {i: "the load changes" for i, (before, after) in loads if before is not after}
        return points | {
            i: "a collision-free motion begins or ends"
            for end, waypoint in enumerate(waypoints)
            if waypoint.way
            for i in (end - 1, end)
            if not (
                waypoints[i].velocity_kind == "unknown"
                and waypoints[i].way == waypoints[i + 1].way
                and all(w.duration_is_unknown and not w.min_duration for w in waypoints[i : i + 2])
            )
        }

    def bodies_in_interval(self, i: int) -> CollisionModel:
        """Bodies of the robot and the scene that are present from waypoint i to the next one."""
        from knotwork.planning.clear_motions.configuration_space import model_at

        return model_at(self._collision_model, i + 0.5)  # its times are indices of waypoints

    @cached_property
    def _collision_model(self) -> CollisionModel:
        """Bodies of the robot and the scene; the index of a waypoint replaces its unknown time."""
        from knotwork.planning.task_to_joint.candidate_collisions import unsolved_collision_model

        if self.joints.robot is None:
            raise TypeError("without a robot there are no bodies")
        times = np.arange(len(self.scenario.waypoints), dtype=float)
        return unsolved_collision_model(self.scenario, self.joints, self.joints.robot, times)

    def where(self, i: int, *key: str) -> str:
        """Location of a key of waypoint i of the scenario, for messages."""
        task_i = self.scenario.task_index[i]
        location: tuple[str | int, ...] = ("waypoints", task_i) if task_i >= 0 else ("start",)
        return self.scenario.where(*location, *key)
