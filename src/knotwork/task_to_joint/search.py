"""The choice of one solution at each waypoint of a scenario, over the whole sequence."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from knotwork.errors import OutOfReachError
from knotwork.kinematics.chain.joint_ranges import difference, middle, whole_turns
from knotwork.kinematics.geometry.configuration_flags import configuration_flags
from knotwork.kinematics.sequence.candidates import (
    Candidates,
    candidates_of,
    find_candidates,
    nearest_candidate,
)
from knotwork.kinematics.sequence.choice import Sequence, choose_sequence
from knotwork.kinematics.sequence.cost import Cost
from knotwork.kinematics.sequence.nearness import weights
from knotwork.kinematics.sequence.step_costs import Layer
from knotwork.robot.joint_axes import joint_axes
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.task_to_joint.branches import allowed_rows, check_branch, no_branch
from knotwork.task_to_joint.dependent_waypoints import DependentWaypoints, concatenate
from knotwork.task_to_joint.free_poses import Chain, Chains
from knotwork.task_to_joint.obstacles import Obstacles
from knotwork.task_to_joint.solution import Step
from knotwork.task_to_joint.step_rules import step_rules
from knotwork.task_to_joint.velocities import velocity_at
from knotwork.waypoints import CartesianWaypoint, FloatArray

HOME = "home"


class ChosenSequence(NamedTuple):
    """The chosen sequence.

    Attributes:
        sequence: The choice among the candidates.
        positions: Joint positions [rad or m], shape (n, d).
        velocities: Joint velocities [rad/s or m/s], shape (n, d).
    """

    sequence: Sequence
    positions: FloatArray
    velocities: FloatArray


def home(space: JointSpace) -> FloatArray:
    """The configuration `home`, or the middle of the joints' ranges."""
    if HOME in space.configurations:
        return np.array(space.configurations[HOME])
    return middle((space.lower_position_limit, space.upper_position_limit))


class Search:
    """The search for the best sequence of one scenario.

    Args:
        scenario: The task.
        space: The joints of the scenario, followed by the virtual joints of its freedoms.
        chains: The robot with the virtual joints of each pose.
        avoided: Steps that count as collisions.

    Attributes:
        robot: The robot with its virtual joints.
        given: Joint positions at each waypoint, `None` where a pose is given.
        speeds: Joint velocities at each waypoint, `None` where a pose is given.
        near: Preferred configuration, or `None`.
        rules: Rules for the cost of steps.
        candidates: Candidates at each waypoint; `None` where joint positions are given.
        layers: The candidates allowed_rows at each waypoint, and their costs.
        free_velocity: Waypoints whose speed is chosen later, by index.
        rows: Indices of the allowed_rows candidates.
    """

    def __init__(
        self,
        scenario: Scenario,
        space: JointSpace,
        chains: Chains,
        avoided: Iterable[Step] = (),
    ) -> None:
        robot = chains.whole
        self.scenario, self.space, self.chains, self.robot = scenario, space, chains, robot
        self.near = space.near
        self.given = [None if one is None else one.position for one in space.targets]
        self.speeds = [None if one is None else one.velocity for one in space.targets]
        rules = scenario.scene.rules
        checked = rules.itself or scenario.scene.asks()
        self.obstacles = Obstacles(scenario, space, chains.arm) if checked else None
        self.dependent = DependentWaypoints(scenario, space.waits, chains, self.obstacles)
        self.groups = {i: group for group in self.dependent.groups for i in group}
        check_branch(scenario, robot)
        kinds = scenario.free.speed if scenario.free is not None else ()
        self.free_velocity = {i for i, kind in enumerate(kinds) if kind != "given"}
        self.revolute = joint_axes(robot).revolute
        self.rules = step_rules(scenario, chains, self.speeds, self.free_velocity, avoided)
        self._collide: dict[int, FloatArray] = {}
        self.candidates: list[Candidates | None] = []
        self.layers: list[Layer] = []
        self.rows: list[Any] = []

    def find(self) -> None:
        """Find the candidates at all waypoints.

        Raises:
            OutOfReachError: A pose has no candidate.
            CollisionError: A static object touches the robot at its start.
        """
        result: list[Candidates | None] = [None] * len(self.given)
        for chain in self.chains:
            for i, one in self._find_on_chain(chain).items():
                others = self.space.solutions.get(i)
                others = self._reference(i) if others is None else others
                result[i] = chain.expand(one, self.robot, others)
        self.candidates = self.dependent.complete(result)
        if self.obstacles is not None and self.given[0] is not None and self.scenario.scene.asks():
            self.obstacles.check_start(self.given[0])

    def _find_on_chain(self, chain: Chain) -> dict[int, Candidates]:
        """Candidates at the waypoints that belong to a chain, by index."""
        result: dict[int, Candidates] = {}
        poses, units = [], self.scenario.units
        for i in self.dependent.independent:
            target = self.scenario.waypoints[i]
            if self.chains.at(target) is not chain or not isinstance(target, CartesianWaypoint):
                continue
            if i in self.space.solutions:
                near = self.space.solutions[i][chain.columns]
                result[i] = nearest_candidate(chain.robot, target, near, units)
            else:
                poses.append((i, target))
        references = [self._reference(i)[chain.columns] for i, _ in poses]
        found = find_candidates(chain.robot, [target for _, target in poses], references, units)
        begins = {group[0] for group in self.dependent.groups}
        wanted = begins if self.near is None else set(self.dependent.independent)
        for (i, target), candidates, near in zip(poses, found, references, strict=True):
            if candidates.free and i in wanted:
                candidates = self._add_nearest(chain, target, candidates, near, i in begins)
            result[i] = (
                candidates._replace(
                    excess=np.zeros_like(candidates.excess),
                    velocity=np.zeros_like(candidates.velocity),
                )
                if i in self.free_velocity
                else candidates
            )
        return result

    def _add_nearest(
        self,
        chain: Chain,
        target: CartesianWaypoint,
        candidates: Candidates,
        near: FloatArray,
        begins: bool,
    ) -> Candidates:
        """Candidates of a redundant arm, plus the nearest one refined along its self-motion.

        At the start of a path or a wait the arm is not refined later. Elsewhere it is, but from
        distant samples no motion between waypoints might be feasible.
        """
        from knotwork.kinematics.sequence.null_space_refinement import Given, refine_sequence

        arm, rules = chain.robot, self.rules.of(chain.columns)
        if begins and chain.narrowed is not chain.robot:
            with contextlib.suppress(OutOfReachError):
                narrowed = find_candidates(chain.narrowed, [target], [near], self.scenario.units)[0]
                arm, candidates = chain.narrowed, narrowed
        gaps = difference(candidates.q, near, joint_axes(arm).revolute) / rules.scale
        row = int(np.linalg.norm(gaps, axis=1).argmin())
        given = Given(np.zeros(1), rules, [target], near)
        q = refine_sequence(arm, given, candidates.q[[row]], candidates.velocity[[row]])
        more = candidates_of(chain.robot, target, q[0])
        return concatenate([candidates, more._replace(branch=more.branch + candidates.branches)])

    def solve(self) -> ChosenSequence:
        """Choose positions and velocities at all waypoints, after `find`."""
        chosen = self.choose(self.candidates)
        if chosen.blocked is not None:
            raise no_branch(
                self.scenario, self.robot, chosen.blocked, self.candidates[chosen.blocked]
            )
        positions = self._refine(chosen)
        velocities = [
            velocity_at(self.scenario, self.dependent, i, q, self.speeds[i])
            for i, q in enumerate(positions)
        ]
        return ChosenSequence(chosen, positions, np.array(velocities))

    def choose(self, candidates: list[Candidates | None]) -> Sequence:
        """The best sequence of candidates at each waypoint."""
        self.candidates = candidates
        self.rows = []
        for i, c in enumerate(self.candidates):
            first = self.groups[i][0] if i in self.groups else i
            tied = c is not None and first < i
            self.rows.append(
                self.rows[first] if tied else allowed_rows(self.scenario, self.robot, i, c)
            )
        self.layers = [self._layer(i) for i in range(len(self.given))]
        return choose_sequence(self.layers, self.durations, self.rules)

    def feasible_if_free(self) -> bool:
        """Whether some choice among all branches is within the velocity limits."""
        free = Search(replace(self.scenario, branch="free"), self.space, self.chains)
        chosen = free.choose(self.candidates)
        return not (chosen.cost.impossible or chosen.cost.infeasible)

    @property
    def durations(self) -> FloatArray:
        """Times between the waypoints [s], shape (n - 1,)."""
        return np.diff(self.scenario.provisional_times)

    def _reference(self, index: int) -> FloatArray:
        """The last configuration before a waypoint that is known without a search."""
        if self.near is not None:
            return self.near
        before = [q for q in self.given[:index] if q is not None]
        return before[-1] if before else home(self.space)

    def _layer(self, index: int) -> Layer:
        q, candidates, rows = self.given[index], self.candidates[index], self.rows[index]
        if q is not None or candidates is None:
            one, v = np.array([q]), np.array([self.speeds[index]])
            flags = configuration_flags(self.robot, one)
            cost = Cost(travel=np.zeros(1))
            return Layer(one, cost, weights(self.robot, one), flags, fixed=True, velocity=v)
        q, distance, travel = candidates.q[rows], np.zeros(len(rows)), np.zeros(len(rows))
        if self.near is not None:
            # The nearest branch does not depend on turns. Turns are nearest at the first waypoint
            # and then follow the motion, or joints would be wound back.
            gap = difference(q, self.near, self.revolute)
            distance = np.linalg.norm(gap / self.rules.scale, axis=1)
        elif self.scenario.prefers_clearance and self.obstacles is not None:
            distance = self.obstacles.shortfall(index, candidates)[rows]
        group = self.groups.get(index)
        way = rows if group is not None else None
        before = None
        if group is not None and index > group[0]:
            previous = self.candidates[index - 1]
            before = previous.q[rows] if previous is not None else None
        if index == 0:
            gap = q - (home(self.space) if self.near is None else self.near)
            turns = np.where(self.rules.unbounded, whole_turns(gap), 0.0)
            q, travel = q - turns, np.linalg.norm((gap - turns) / self.rules.scale, axis=1)
        lost, excess = candidates.lost[rows], candidates.excess[rows]
        collisions = self._collisions(index, candidates)[rows]
        cost = Cost(lost, collisions, excess, distance=distance, travel=travel).without_zeros()
        weight, flags = candidates.weight[rows], candidates.flags[rows]
        velocity = candidates.velocity[rows]
        return Layer(q, cost, weight, flags, velocity=velocity, way=way, before=before)

    def _collisions(self, index: int, candidates: Candidates) -> FloatArray:
        """1 for each candidate at a waypoint that collides, otherwise 0."""
        if self.obstacles is None:
            return np.zeros(len(candidates.q))
        if index not in self._collide:
            self._collide[index] = self.obstacles.collide(index, candidates)
        return self._collide[index]

    def _refine(self, chosen: Sequence) -> FloatArray:
        """Move waypoints of a redundant arm along its self-motion to improve the whole motion."""
        # refinement would move these back to the solution that collided
        kept = {i for step in self.rules.colliding for i in (step.interval, step.interval + 1)}
        free = [
            c is not None and c.free and i not in self.groups and i not in kept
            for i, c in enumerate(self.candidates)
        ]
        if not any(free) or self.scenario.prefers_clearance:
            return chosen.q
        from knotwork.kinematics.sequence.null_space_refinement import Given, refine_sequence

        v = [
            c.velocity[rows[k]] if c is not None else given
            for c, rows, k, given in zip(
                self.candidates, self.rows, chosen.index, self.speeds, strict=True
            )
        ]
        refined, velocity = chosen.q.copy(), np.array(v)
        for chain in self.chains:
            own = chain.columns
            moved = [
                target
                if moves
                and isinstance(target, CartesianWaypoint)
                and self.chains.at(target) is chain
                else None
                for target, moves in zip(self.scenario.waypoints, free, strict=True)
            ]
            if not any(moved):
                continue
            given = Given(
                self.scenario.provisional_times,
                self.rules.of(own),
                moved,
                None if self.near is None else self.near[own],
                home(self.space)[own] if self.given[0] is None else None,
                frozenset(self.free_velocity),
            )
            refined[:, own] = refine_sequence(chain.robot, given, refined[:, own], velocity[:, own])
        if self.obstacles is not None:
            for i, (q, waypoint) in enumerate(zip(refined, self.scenario.waypoints, strict=True)):
                if free[i] and self.obstacles.collides(q, waypoint.time):
                    return chosen.q
        return refined
