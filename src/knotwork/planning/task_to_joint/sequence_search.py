"""Search for the best sequence of IK solutions through all waypoints of a scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, cast

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.planning.task_to_joint.candidate_collisions import CandidateCollisions
from knotwork.planning.task_to_joint.dependent_waypoints import (
    GroupSolver,
    dependent_groups,
)
from knotwork.planning.task_to_joint.free_poses import FreedomChain, FreedomChains
from knotwork.planning.task_to_joint.path_track import PathTrack, track_of
from knotwork.planning.task_to_joint.requested_branch import (
    check_branch,
    make_branch_error,
    require_branch,
)
from knotwork.planning.task_to_joint.step_rules import joint_rules, step_rules
from knotwork.planning.task_to_joint.task_solution import SequenceStep
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.kinematics.chain.joint_ranges import (
    joint_difference,
    range_middles,
    whole_turns,
)
from knotwork.robot.kinematics.chain.velocity import pull_to_middle, solve_velocity_ik
from knotwork.robot.kinematics.following.continuation import velocity_on_path
from knotwork.robot.kinematics.geometry.configuration_flags import configuration_flags
from knotwork.robot.kinematics.sequence.candidates import (
    Candidates,
    find_candidates,
    find_nearest_candidate,
)
from knotwork.robot.kinematics.sequence.cost import make_cost
from knotwork.robot.kinematics.sequence.nearness import travel_weights
from knotwork.robot.kinematics.sequence.shortest_sequence import choose_sequence
from knotwork.robot.kinematics.sequence.step_costs import Layer
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.waypoints import CartesianWaypoint


class ChosenSequence(NamedTuple):
    """The chosen sequence.

    Attributes:
        cost: Cost of the sequence, one value per `CostLevel`.
        positions: Joint positions [rad or m], shape (n, d).
        velocities: Joint velocities [rad/s or m/s], shape (n, d).
        candidates: Candidates at each waypoint; `None` where joint positions are given.
        tracks: Tracks of the paths.
    """

    cost: FloatArray
    positions: FloatArray
    velocities: FloatArray
    candidates: list[Candidates | None]
    tracks: list[PathTrack]


def home_configuration(joints: ScenarioJoints) -> FloatArray:
    """The configuration `home`, or the middle of the joints' ranges."""
    robot = joints.robot
    if robot is not None and "home" in robot.configurations:
        return np.array(robot.configurations["home"])
    return range_middles(joints.limits.bounds("position"))


class SequenceSearch:
    """The search for the best sequence of one scenario.

    Args:
        scenario: The scenario.
        joints: The joints of the scenario, followed by the virtual joints of its freedoms.
        chains: The robot with the virtual joints of each pose.
        blocked_steps: Steps that count as collisions.
        earlier_tracks: See `GroupSolver`.

    Attributes:
        robot: The robot with its virtual joints.
        near: Preferred configuration, or `None`.
        unknown_speeds: Waypoints whose speed is chosen later, by index.
        joint_rules: Rules for the joints.
        steps: Rules for the interval after each waypoint but the last.
    """

    def __init__(
        self,
        scenario: Scenario,
        joints: ScenarioJoints,
        chains: FreedomChains,
        blocked_steps: Sequence[SequenceStep],
        earlier_tracks: Mapping[int, PathTrack],
    ) -> None:
        robot = chains.arm_with_freedoms
        self.scenario, self.joints, self.chains, self.robot = scenario, joints, chains, robot
        self.near, self.earlier_tracks = joints.near, earlier_tracks
        self.collisions = CandidateCollisions.for_scenario(scenario, joints, chains.arm)
        groups = dependent_groups(scenario, joints.rest_intervals)
        self._group_of = {i: group for group in groups for i in group}
        check_branch(scenario, robot)
        waypoint_unknowns = scenario.unknowns.at_waypoints if scenario.unknowns is not None else ()
        self.unknown_speeds = frozenset(
            i for i, waypoint in enumerate(waypoint_unknowns) if waypoint.velocity_kind != "given"
        )
        self.joint_rules = joint_rules(robot)
        self.steps = step_rules(
            scenario, chains, joints.targets, self.unknown_speeds, blocked_steps
        )

    def solve(self) -> ChosenSequence:
        """Choose positions and velocities at all waypoints.

        Raises:
            OutOfReachError: A pose has no candidate.
            CollisionError: A static object touches the robot at its start.
            FollowingError: No candidate can follow a path to its end.
            BranchError: No sequence of candidates is in the requested branch.
            SingularityError: The chosen configuration does not allow the velocity at a waypoint.
        """
        candidates, tracks = self._find_candidates()
        start = self.joints.targets[0]
        if self.collisions is not None and start is not None and self.scenario.scene.has_bodies:
            self.collisions.check_start(start.position)
        layers = [self._layer(i, candidates) for i in range(len(candidates))]
        sequence = choose_sequence(layers, self.joint_rules, self.steps)
        blocked = sequence.blocked_at
        if blocked is not None:
            raise make_branch_error(self.scenario, self.robot, blocked, candidates[blocked])
        positions = sequence.q
        velocities = [
            velocity_at(self.scenario, self.chains, track_of(tracks, i), i, q)
            if target is None
            else target.velocity
            for i, (q, target) in enumerate(zip(positions, self.joints.targets, strict=True))
        ]
        return ChosenSequence(sequence.cost, positions, np.array(velocities), candidates, tracks)

    def _find_candidates(self) -> tuple[list[Candidates | None], list[PathTrack]]:
        """Find the candidates at all waypoints, and the tracks of the paths."""
        candidates: list[Candidates | None] = [None] * len(self.joints.targets)
        tracks: list[PathTrack] = []
        for chain in self.chains:
            for i, on_chain in self._find_on_chain(chain).items():
                reference = self.joints.near_at_waypoints.get(i, self._reference(i))
                candidates[i] = chain.expand(on_chain, self.robot, reference)
        solver = GroupSolver(self.scenario, self.chains, self.collisions, self.earlier_tracks)
        for group in dict.fromkeys(self._group_of.values()):
            first = candidates[group[0]]
            if first is not None:
                solution = solver.solve(group, first)
                candidates[group.start : group.stop] = solution.candidates
                tracks += solution.tracks
        return candidates, tracks

    def _find_on_chain(self, chain: FreedomChain) -> dict[int, Candidates]:
        """Candidates at the independent waypoints that belong to a chain, by index."""
        units, poses, result = self.scenario.units, {}, {}
        for i, waypoint in enumerate(self.scenario.waypoints):
            independent = i not in self._group_of or self._group_of[i][0] == i
            if (
                not independent
                or not isinstance(waypoint, CartesianWaypoint)
                or self.chains.for_waypoint(waypoint) is not chain
            ):
                continue
            if i in self.joints.near_at_waypoints:
                near = self.joints.near_at_waypoints[i][chain.columns]
                result[i] = find_nearest_candidate(chain.robot, waypoint, near, units)
            else:
                poses[i] = waypoint
        references = [self._reference(i)[chain.columns] for i in poses]
        several = find_candidates(chain.robot, list(poses.values()), references, units)
        for i, candidates in zip(poses, several, strict=True):
            if i in self.unknown_speeds:
                zero = np.zeros_like(candidates.velocity)
                candidates = candidates._replace(overspeed=zero[:, 0], velocity=zero)
            result[i] = candidates
        return result

    def _reference(self, i: int) -> FloatArray:
        """The last known configuration before a waypoint, without a search."""
        if self.near is not None:
            return self.near
        before = (target.position for target in self.joints.targets[:i][::-1] if target is not None)
        return next(before, home_configuration(self.joints))

    def _layer(self, i: int, candidates_by_waypoint: Sequence[Candidates | None]) -> Layer:
        """The candidates at a waypoint in the requested branch, with their costs."""
        target = self.joints.targets[i]
        if target is not None:
            q, v = target.position[None], target.velocity[None]
            flags, weight = configuration_flags(self.robot, q), travel_weights(self.robot, q)
            return Layer(q, v, make_cost(1), weight, flags, fixed=True)
        candidates = cast(Candidates, candidates_by_waypoint[i])
        group = self._group_of.get(i)
        first = i if group is None else group[0]
        begin = cast(Candidates, candidates_by_waypoint[first])
        rows = np.flatnonzero(require_branch(self.scenario, self.robot, first, begin))
        q = candidates.q[rows]
        distance, travel = np.zeros((2, len(rows)))
        if self.near is not None:
            # The nearest branch does not depend on turns. Turns are nearest at the first waypoint
            # and then follow the motion, so that joints do not unwind.
            offset = joint_difference(q, self.near, joint_axes(self.robot).is_revolute)
            distance = np.linalg.norm(offset / self.joint_rules.scale, axis=1)
        elif self.scenario.task.prefer == "clearance" and self.collisions is not None:
            distance = self.collisions.clearance_cost(i, candidates)[rows]
        if i == 0:
            offset = q - (home_configuration(self.joints) if self.near is None else self.near)
            turns = np.where(self.joint_rules.unbounded, whole_turns(offset), 0.0)
            q, travel = q - turns, np.linalg.norm((offset - turns) / self.joint_rules.scale, axis=1)
        collisions = np.zeros(len(rows))
        if self.collisions is not None:
            collisions = self.collisions.collision_cost(i, candidates)[rows]
        cost = make_cost(
            len(rows),
            impossible=candidates.unattainable[rows],
            collisions=collisions,
            overspeed=candidates.overspeed[rows],
            distance=distance,
            travel=travel,
        )
        previous = candidates_by_waypoint[i - 1] if first < i else None
        return Layer(
            q,
            candidates.velocity[rows],
            cost,
            candidates.weight[rows],
            candidates.flags[rows],
            group_row=None if group is None else rows,
            previous_q=None if previous is None else previous.q[rows],
        )


def velocity_at(
    scenario: Scenario, chains: FreedomChains, track: PathTrack | None, i: int, q: FloatArray
) -> FloatArray:
    """Joint velocities for the tool's twist at a waypoint [rad/s or m/s], shape (d,).

    Args:
        scenario: The scenario.
        chains: The robot with the virtual joints of each pose.
        track: Track of the path of the waypoint, if it is on one.
        i: Index of the waypoint, which is given by a pose.
        q: Joint positions at the waypoint [rad or m], shape (d,).

    Raises:
        SingularityError: The twist is unattainable.
    """
    waypoint, rate = cast(CartesianWaypoint, scenario.waypoints[i]), scenario.task.pull_to_middle
    chain = chains.for_waypoint(waypoint) if track is None else track.chain
    robot, q = chain.robot, q[chain.columns]
    if track is not None:
        self_motion_target = track.self_motion_target(waypoint.time, q)
        return chain.scatter(
            velocity_on_path(robot, track.path.timed_path, q, waypoint.time, self_motion_target)
        )

    def solve(preferred: FloatArray | None) -> FloatArray:
        return solve_velocity_ik(
            robot,
            q,
            waypoint.twist,
            preferred=preferred,
            waypoint=waypoint.name,
            where=waypoint.where,
            units=scenario.units,
        )

    v = solve(None)
    if not rate or not v.any():
        return chain.scatter(v)
    self_motion = solve(pull_to_middle(robot, q, rate)) - v
    return chain.scatter(v + _largest_fraction(v, self_motion, robot.limits.velocity) * self_motion)


def _largest_fraction(v: FloatArray, change: FloatArray, limit: FloatArray) -> float:
    """The largest fraction of a change, up to 1, that keeps every velocity within its limit."""
    margin = np.maximum(np.where(change > 0, limit - v, limit + v), 0.0)
    return float((margin / np.maximum(np.abs(change), 1e-300)).min(initial=1.0, where=change != 0))
