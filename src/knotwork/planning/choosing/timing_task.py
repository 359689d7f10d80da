"""`TimingTask`: a scenario with unknowns, and its waypoints at the joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from knotwork.curves.interpolation import BalancedKnots
from knotwork.errors import InputError
from knotwork.planning.task_to_joint import PathStart, TaskSolution
from knotwork.task.scenario import Scenario, ScenarioPath, Unknowns, resolve_task
from knotwork.task.scenario.joint_space import JointSpace
from knotwork.waypoints import IndexArray, JointWaypoints

ErrorT = TypeVar("ErrorT", bound=InputError)

if TYPE_CHECKING:
    from knotwork.planning.timing import Dynamics
    from knotwork.robot import Robot
    from knotwork.scene.collision_model import CollisionModel


def knots_of(scenario: Scenario) -> Any:
    """Knot rule along tool paths."""
    knots = scenario.knots
    return BalancedKnots(float(knots)) if isinstance(knots, int | float) else knots


def with_clear_motions(scenario: Scenario, ends: Sequence[int]) -> Scenario:
    """The scenario with `way: clear` at some waypoints, by index."""
    waypoints = list(scenario.given.waypoints)
    for place in (scenario.index[i] for i in ends):
        waypoints[place] = waypoints[place].replace(way="clear")
    return resolve_task(scenario.given.replace(waypoints=tuple(waypoints)), scenario.places)


@dataclass(frozen=True, eq=False)
class TimingTask:
    """A scenario with unknowns, and its waypoints at the joints.

    Attributes:
        scenario: The task.
        unknowns: Its unknowns.
        space: Its joints.
        solution: Its waypoints at the joints, free times as expected.
    """

    scenario: Scenario
    unknowns: Unknowns
    space: JointSpace
    solution: TaskSolution

    @property
    def waypoints(self) -> JointWaypoints:
        """All waypoints at the joints, including inserted ones along paths."""
        return self.solution.waypoints

    @property
    def rows(self) -> IndexArray:
        """Rows of the scenario's waypoints, shape (n,)."""
        return np.array(self.waypoints.task_rows)

    def start(self, path: ScenarioPath) -> PathStart:
        """State of the arm at the start of a path, with virtual joints for the poses' freedom."""
        known = self.solution.starts.get(path.first)
        if known is not None:
            return known
        robot = cast("Robot", self.space.robot)  # only robots follow paths
        q = self.waypoints.position[self.rows[path.first]]
        return PathStart(robot, q, self.scenario.task.pull_to_middle)

    @cached_property
    def _dynamics(self) -> tuple[Dynamics, ...]:
        """Dynamics from each waypoint to the next; one shared object for equal loads."""
        from knotwork.planning.timing import Dynamics

        carrying = self.space.carrying
        carried = carrying.by_interval if carrying is not None else ()
        models = {id(robot): Dynamics(robot) for robot in carried}
        return tuple(models[id(robot)] for robot in carried)

    def dynamics(self, i: int) -> Dynamics | None:
        """Dynamics of its robot, if there is one, with the load from waypoint i on."""
        return self._dynamics[i] if self._dynamics else None

    @cached_property
    def zero_acceleration_points(self) -> Mapping[int, str]:
        """Waypoints with zero acceleration, and a text of the reason.

        Segments are split there. Two collision-free motions are one if only a position is given
        between them.
        """
        unknowns = self.unknowns
        open_time = unknowns.duration & (unknowns.at_least == 0.0)
        loads = enumerate(pairwise(self._dynamics), start=1)
        points = {i: "the load changes" for i, (before, after) in loads if before is not after}
        return points | {
            i: "a collision-free motion begins or ends"
            for end in unknowns.ways
            for i in (end - 1, end)
            if not (
                unknowns.speed[i] == "free"
                and unknowns.ways.get(i) == unknowns.ways.get(i + 1)
                and open_time[i - 1 : i + 1].all()
            )
        }

    @cached_property
    def collision_model(self) -> CollisionModel:
        """Bodies of the robot and the scene; the index of a waypoint is the time in it."""
        from knotwork.planning.task_to_joint.obstacles import bodies_and_pairs

        if self.space.robot is None:
            raise TypeError("without a robot there are no bodies")
        times = np.arange(len(self.scenario.waypoints), dtype=float)
        return bodies_and_pairs(self.scenario, self.space, self.space.robot, times)

    def locate(self, error: ErrorT, i: int, *key: str) -> ErrorT:
        """The error with its location in the file: a key of waypoint i of the scenario."""
        k = self.scenario.index[i]
        place: tuple[str | int, ...] = ("waypoints", k) if k >= 0 else ("start",)
        error.locate(self.scenario.where(*place, *key))
        return error
