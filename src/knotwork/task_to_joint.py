"""A scenario's waypoints at the joints: inverse kinematics, position (eq 3) and velocity (eq 4).

One solution of each pose is chosen over the whole sequence: see `solve_task`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.errors import BranchError, UnknownNameError
from knotwork.joint_space import JointSpace
from knotwork.scenario import JointTarget, Scenario
from knotwork.waypoints import CartesianWaypoint, FloatArray, JointWaypoints

if TYPE_CHECKING:
    from knotwork.kinematics.candidates import Candidates
    from knotwork.kinematics.sequence import Layer, Sequence
    from knotwork.robot import Robot

HOME = "home"
# With `near`, travel decides only between solutions that are equally near.
TRAVEL_BESIDE_NEAR = 1e-6
# What a change of branch costs where the branch is to be kept [s]: more than any travel, less than
# breaking a velocity limit.
CHANGE = 1e4


@dataclass(frozen=True)
class Choice:
    """The solution chosen at a waypoint given by a pose.

    Attributes:
        waypoint: Name of the waypoint.
        branch: What its branch is called, for example `shoulder left, elbow up, no flip`; empty
            where branches have no names.
        turns: Joint and whole turns away from within half a turn of zero, where there are any.
        branches: Branches inside the limits; for an arm that moves freely at the pose, samples.
        solutions: Solutions inside the limits, turns counted.
        sampled: The arm moves freely at the pose.
        reason: Why this one.
    """

    waypoint: str
    branch: str
    turns: tuple[tuple[str, int], ...]
    branches: int
    solutions: int
    sampled: bool
    reason: str


@dataclass(frozen=True, eq=False)
class TaskSolution:
    """Waypoints at the joints, and how they were chosen.

    Attributes:
        waypoints: Joint positions and velocities.
        choices: For the waypoints given by poses, in order.
        obstacles: What can't be done within the velocity limits however the solutions are chosen:
            the interval, the joint, the speed it needs and the time that would do.
    """

    waypoints: JointWaypoints
    choices: tuple[Choice, ...]
    obstacles: tuple[str, ...] = ()


def task_to_joint(scenario: Scenario, space: JointSpace) -> JointWaypoints:
    """Find the joint positions and velocities that meet each waypoint: see `solve_task`."""
    return solve_task(scenario, space).waypoints


def solve_task(scenario: Scenario, space: JointSpace) -> TaskSolution:
    """Find the joint positions and velocities that meet each waypoint, over the whole sequence.

    Of all solutions of all poses, turns of ±2π within limits included, the sequence is taken

    1. that is feasible: the joint speeds that the twists ask for, and the mean speed of each
       interval, within the velocity limits;
    2. among those, of least joint travel: the sum over the intervals of the norm of the joint
       motions, each divided by the joint's velocity limit, weighted up to threefold near position
       limits and singularities. Without a start it includes the way from the robot's home.

    With `near` in the scenario, the nearest to that instead of least travel, whole turns aside:
    these are the nearest at the first waypoint, and then follow the motion. With `branch`, only
    what that allows. Where nothing is feasible, the sequence that exceeds the velocity limits
    least is taken, and what exceeds them is named in `obstacles`.

    Args:
        scenario: The task.
        space: The joints and the robot it is for.

    Raises:
        UnreachablePoseError: No configuration reaches a pose.
        OutsideLimitsError: A pose is reached only with joints outside their limits.
        BranchError: A pose is not reached in the branch asked for.
        SingularityError: The arm can't move as asked at a waypoint.
        DocumentError: Joint values name a joint or configuration that does not exist.
    """
    targets = scenario.waypoints
    given = [space.values(t.joints) if isinstance(t, JointTarget) else None for t in targets]
    near = space.values(scenario.near, missing=None) if scenario.near is not None else None
    choices: tuple[Choice, ...] = ()
    obstacles: tuple[str, ...] = ()
    if any(q is None for q in given):
        if space.robot is None:
            raise UnknownNameError("robot", "", (), where=targets[given.index(None)].where)
        search = _Search(scenario, space, space.robot, given, near)
        positions, velocities = search.solve()
        choices, obstacles = search.choices(), search.obstacles(positions)
    else:
        positions = np.array(given)
        velocities = [_given_velocity(t, space) for t in targets if isinstance(t, JointTarget)]
    waypoints = JointWaypoints(
        joint_names=space.joint_names,
        time=scenario.times,
        position=positions,
        velocity=np.array(velocities),
        names=tuple(waypoint.name for waypoint in targets),
        joint_units=space.joint_units,
    )
    return TaskSolution(waypoints, choices, obstacles)


def _given_velocity(target: JointTarget, space: JointSpace) -> FloatArray:
    if target.velocity is None:
        return np.zeros(len(space.joint_names))
    return space.values(target.velocity, missing=0.0)


def home(space: JointSpace) -> FloatArray:
    """Home, or for a robot that has none the middle of the joints' ranges."""
    if HOME in space.configurations:
        return np.array(space.configurations[HOME])
    bounded = np.isfinite(space.lower_position_limit) & np.isfinite(space.upper_position_limit)
    middle = np.zeros(len(space.joint_names))
    middle[bounded] = (
        space.lower_position_limit[bounded] + space.upper_position_limit[bounded]
    ) / 2
    return middle


class _Search:
    """The search for the best sequence of one scenario."""

    def __init__(
        self,
        scenario: Scenario,
        space: JointSpace,
        robot: Robot,
        given: list[FloatArray | None],
        near: FloatArray | None,
    ) -> None:
        from knotwork.kinematics.sequence import Rules

        self.scenario, self.space, self.robot = scenario, space, robot
        self.given, self.near = given, near
        limit = robot.velocity_limit
        speed = np.where(np.isfinite(limit), limit, 1.0)
        bounded = np.isfinite(robot.lower_position_limit) & np.isfinite(robot.upper_position_limit)
        turns = np.array([unit == "rad" for unit in robot.joint_units]) & ~bounded
        change = {"free": 0.0, "keep": CHANGE, "fixed": np.inf}
        wanted = scenario.branch
        self.rules = Rules(
            speed=speed,
            limit=limit,
            unbounded=turns,
            travel=1.0 if near is None else TRAVEL_BESIDE_NEAR,
            change=change[wanted] if isinstance(wanted, str) else 0.0,
        )
        self.turning = turns
        self.revolute = np.array([unit == "rad" for unit in robot.joint_units])

    def solve(self) -> tuple[FloatArray, list[FloatArray]]:
        """Positions and velocities at all waypoints."""
        from knotwork.kinematics import solve_velocity_ik
        from knotwork.kinematics.sequence import choose_sequence

        self.candidates = self._candidates()
        layers = [self._layer(i) for i in range(len(self.given))]
        durations = np.diff(self.scenario.times)
        chosen = choose_sequence(layers, durations, self.rules)
        if chosen.blocked is not None:
            raise self._no_branch(chosen.blocked)
        self.chosen = chosen
        positions = self._settled(chosen)
        velocities = []
        for q, target in zip(positions, self.scenario.waypoints, strict=True):
            if isinstance(target, JointTarget):
                velocities.append(_given_velocity(target, self.space))
                continue
            velocities.append(
                solve_velocity_ik(
                    self.robot, q, target.twist, waypoint=target.name, where=target.where
                )
            )
        return positions, velocities

    def _candidates(self) -> list[Candidates | None]:
        from knotwork.kinematics.candidates import find_candidates

        poses = [
            (i, target)
            for i, target in enumerate(self.scenario.waypoints)
            if isinstance(target, CartesianWaypoint)
        ]
        references = [self._reference(i) for i, _ in poses]
        found = find_candidates(self.robot, [target for _, target in poses], references)
        result: list[Candidates | None] = [None] * len(self.given)
        for (i, _), candidates in zip(poses, found, strict=True):
            result[i] = candidates
        return result

    def _reference(self, index: int) -> FloatArray:
        """The configuration nearest in the sequence that is known beforehand."""
        if self.near is not None:
            return self.near
        before = [q for q in self.given[:index] if q is not None]
        return before[-1] if before else home(self.space)

    def _layer(self, index: int) -> Layer:
        from knotwork.kinematics.candidates import limit_nearness
        from knotwork.kinematics.sequence import Layer
        from knotwork.kinematics.words import branch_signs

        q, candidates = self.given[index], self.candidates[index]
        if q is not None or candidates is None:
            one = np.array([q])
            signs = branch_signs(self.robot, one)
            if not isinstance(self.scenario.branch, str):
                signs = np.zeros_like(signs)
            weight = 1.0 + limit_nearness(self.robot, one)
            return Layer(one, np.zeros(1), weight, signs, fixed=True)
        allowed = self._allowed(index, candidates)
        q = candidates.q[allowed]
        cost, weight = candidates.cost[allowed], candidates.weight[allowed]
        if self.near is not None:
            # Which branch is nearest does not depend on turns: these are the nearest at the first
            # waypoint and then follow the motion, or joints would be wound back on the way.
            gap = q - self.near
            gap -= np.where(self.revolute, 2 * np.pi * np.round(gap / (2 * np.pi)), 0.0)
            cost = cost + np.linalg.norm(gap / self.rules.speed, axis=1)
        if index == 0:
            gap = q - (home(self.space) if self.near is None else self.near)
            turns = np.where(self.turning, np.round(gap / (2 * np.pi)), 0.0)
            q, gap = q - 2 * np.pi * turns, gap - 2 * np.pi * turns
            cost = cost + self.rules.travel * np.linalg.norm(gap / self.rules.speed, axis=1)
        return Layer(q, cost, weight, candidates.signs[allowed])

    def _allowed(self, index: int, candidates: Candidates) -> Any:
        """Indices of the candidates in the branch asked for by name."""
        wanted = self.scenario.branch
        if isinstance(wanted, str):
            return np.arange(len(candidates.q))
        from knotwork.kinematics.words import WORDS, geometry

        if geometry(self.robot) is None:
            target = self.scenario.waypoints[index]
            raise BranchError(
                target.name,
                f"branch: {', '.join(wanted)} can't be chosen for {self.robot.name}: these words "
                "are defined for arms of six joints with a spherical wrist, or with three "
                "parallel axes, 2 to 4",
                branches=(),
                where=target.where,
            )
        signs = np.array(
            [
                0.0 if k not in wanted else 1.0 if wanted[k] == w[0] else -1.0
                for k, w in WORDS.items()
            ]
        )
        allowed = np.flatnonzero((candidates.signs * signs >= 0).all(axis=1))
        if not allowed.size:
            raise self._no_branch(index)
        return allowed

    def _no_branch(self, index: int) -> BranchError:
        from knotwork.kinematics.words import describe_branch

        target, candidates = self.scenario.waypoints[index], self.candidates[index]
        there: tuple[str, ...] = ()
        if candidates is not None:
            there = tuple(
                dict.fromkeys(describe_branch(self.robot, signs) for signs in candidates.signs)
            )
        wanted = self.scenario.branch
        asked = (
            "the branch of the waypoints before it"
            if isinstance(wanted, str)
            else "branch " + ", ".join(f"{k}: {v}" for k, v in wanted.items())
        )
        reached = f"; it is reached in: {'; '.join(there)}" if there else ""
        return BranchError(
            target.name,
            f"can't be reached in {asked}{reached}",
            branches=there,
            where=target.where,
        )

    def _settled(self, chosen: Sequence) -> FloatArray:
        """Move free arms along their free motion to where the way through is shortest."""
        positions = chosen.q.copy()
        free = [i for i, c in enumerate(self.candidates) if c is not None and c.free]
        if not free:
            return positions
        from knotwork.kinematics.settling import settle_sequence

        return settle_sequence(
            self.robot,
            positions,
            [
                target if i in free and isinstance(target, CartesianWaypoint) else None
                for i, target in enumerate(self.scenario.waypoints)
            ],
            self.near if self.near is not None else None,
            home(self.space) if self.given[0] is None else None,
        )

    def choices(self) -> tuple[Choice, ...]:
        """How each waypoint given by a pose was solved."""
        from knotwork.kinematics.words import branch_signs, describe_branch

        result = []
        for i, candidates in enumerate(self.candidates):
            if candidates is None:
                continue
            q = self.chosen.q[i]
            turns = np.round(q / (2 * np.pi)).astype(int)
            turned = tuple(
                (name, int(turn))
                for name, turn, unit in zip(
                    self.robot.joint_names, turns, self.robot.joint_units, strict=True
                )
                if turn and unit == "rad"
            )
            result.append(
                Choice(
                    waypoint=self.scenario.waypoints[i].name,
                    branch=describe_branch(self.robot, branch_signs(self.robot, q[None])[0]),
                    turns=turned,
                    branches=candidates.branches,
                    solutions=len(candidates.q),
                    sampled=candidates.free,
                    reason=self._reason(candidates),
                )
            )
        return tuple(result)

    def _reason(self, candidates: Candidates) -> str:
        from knotwork.kinematics.sequence import INFEASIBLE

        if len(candidates.q) == 1:
            return "the only solution"
        feasible = int((candidates.cost < INFEASIBLE).sum())
        wanted = self.scenario.branch
        if isinstance(wanted, str):
            asked = {"free": "", "keep": ", branch kept", "fixed": ", branch fixed"}[wanted]
        else:
            asked = ", branch as asked"
        if feasible == 0:
            return f"least beyond the velocity limits{asked}"
        aim = "nearest to near" if self.near is not None else "least travel"
        left = len(candidates.q) - feasible
        fast = f"; {left} too fast for the joints" if left else ""
        return f"{aim}{asked}{fast}"

    def obstacles(self, positions: FloatArray) -> tuple[str, ...]:
        """Intervals whose mean speed is beyond a limit whatever is chosen."""
        said = []
        names, times = [t.name for t in self.scenario.waypoints], self.scenario.times
        limit = self.robot.velocity_limit
        for i, duration in enumerate(np.diff(times)):
            move = np.abs(positions[i + 1] - positions[i])
            for j in np.flatnonzero(move > limit * duration * (1 + 1e-9)):
                unit = self.robot.joint_units[j]
                said.append(
                    f"from {names[i]!r} to {names[i + 1]!r} {self.robot.joint_names[j]} needs "
                    f"{move[j] / duration:.4g} {unit}/s on average (limit {limit[j]:.4g}) with "
                    f"every choice of solutions; {move[j] / limit[j]:.4g} s or more would do for "
                    f"the mean, and they have {duration:.4g} s"
                )
        return tuple(said)
