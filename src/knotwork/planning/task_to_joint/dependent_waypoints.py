"""Waypoints whose solutions follow from the previous one: along tool paths and during waits."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from knotwork.arrays import BoolArray, FloatArray, IndexArray
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.errors import FollowingError, LimitingConstraint
from knotwork.planning.task_to_joint.free_poses import FreedomChain, FreedomChains
from knotwork.planning.task_to_joint.obstacles import COLLISION_SAMPLES, Obstacles
from knotwork.planning.task_to_joint.requested_branch import is_in_branch
from knotwork.planning.task_to_joint.solution import PathStart
from knotwork.robot.kinematics.chain.joint_ranges import whole_turns
from knotwork.robot.kinematics.following.continuation import Continuation, continue_along
from knotwork.robot.kinematics.following.joint_field import Guide, Pull
from knotwork.robot.kinematics.following.limiting_constraint import make_following_error
from knotwork.robot.kinematics.geometry.configuration_flags import configuration_flags
from knotwork.robot.kinematics.sequence.candidates import Candidates
from knotwork.robot.kinematics.sequence.nearness import limit_nearness
from knotwork.task.scenario import Scenario, ScenarioPath

SAME_START = 1e-9
"""Starts within this distance belong to the same continuation [rad or m]."""
MAX_GUIDED = 12
"""If no candidate can follow the paths with least-norm joint velocities, planned self-motion
(`Ladder`) is tried from this number of branches, the cheapest first, until one succeeds.
"""
GUIDED_SAMPLES_FACTOR = 4
"""Factor on the number of collision tests along planned self-motion."""


def dependent_groups(scenario: Scenario, waits: Sequence[int]) -> list[range]:
    """Groups of consecutive waypoints that follow from the first of the group.

    Args:
        scenario: The task.
        waits: Indices of the waypoints where a wait begins; the next waypoint is equal.
    """
    dependent = {i + 1 for i in waits}
    for path in scenario.paths:
        dependent.update(range(path.first + 1, path.last + 1))
    groups: list[range] = []
    for i in sorted(dependent):
        if groups and groups[-1].stop == i:
            groups[-1] = range(groups[-1].start, i + 1)
        else:
            groups.append(range(i - 1, i + 1))
    return groups


class PathTrack(NamedTuple):
    """A path, and the choices with which the arm follows it.

    Attributes:
        path: The path.
        chain: The arm with the virtual joints of the path's freedom.
        rate: Rate at which self-motion moves joints to the middle of their ranges [1/s].
        guide: Curve that self-motion follows in place of that.
        continuation: Continuations of candidates along the path, if known.
    """

    path: ScenarioPath
    chain: FreedomChain
    rate: float
    guide: Guide | None = None
    continuation: Continuation | None = None

    def pull(self, time: float, q: FloatArray) -> Pull:
        """Target of the self-motion at joint positions (d,) of the chain at a time [s]."""
        if self.guide is None:
            return self.rate
        s = self.path.motion.arc_length(time)
        return self.guide.offset(whole_turns(q - self.guide.posture(s)))

    def start(self, q: FloatArray) -> PathStart:
        """Start of the path, from the positions of all joints [rad or m]."""
        start = q[self.chain.columns]
        return PathStart(self.chain.robot, start, self.pull(self.path.motion.start_time, start))

    def continuation_from(self, start: FloatArray) -> Continuation | None:
        """The continuation from joint positions (d,) of the chain, if it is known."""
        if self.continuation is None:
            return None
        gaps = start - self.continuation.position[0]
        distance = np.abs(gaps - whole_turns(gaps)).max(axis=1)
        row = int(distance.argmin())
        if distance[row] > SAME_START:
            return None
        return self.continuation.select(row, whole_turns(gaps[row]))


class GroupSolution(NamedTuple):
    """Candidates that can follow a group of dependent waypoints to its end.

    Attributes:
        candidates: Candidates at each waypoint; row k of each follows from row k of the previous.
        tracks: Tracks of the paths of the group.
    """

    candidates: list[Candidates]
    tracks: list[PathTrack]


@dataclass(eq=False)
class _BlockedPathError(Exception):
    """No candidate can follow a path.

    Attributes:
        track: The path.
        continuation: Continuations of the candidates.
        branches: Index of the continuation of each of m candidates, shape (m,).
        turns: Offset of each candidate from its continuation [rad], shape (m, d).
        in_branch: Whether each is in the requested branch; all if none is, shape (m,).
        contacts: Step of the first collision, by index of the continuation.
    """

    track: PathTrack
    continuation: Continuation
    branches: IndexArray
    turns: FloatArray
    in_branch: BoolArray
    contacts: Mapping[int, int]


@dataclass(frozen=True, eq=False)
class GroupSolver:
    """Continues candidates through groups of dependent waypoints.

    Attributes:
        scenario: The task.
        chains: The robot with the virtual joints of each pose.
        obstacles: Collision model of the arm and the scene, or `None`.
    """

    scenario: Scenario
    chains: FreedomChains
    obstacles: Obstacles | None = None

    def solve(self, group: range, first: Candidates) -> GroupSolution:
        """Continue candidates at the first waypoint through a group.

        Candidates that reach the end are kept. If none does, self-motion is planned, and then
        virtual joints that slow down before their limits are used.

        Raises:
            FollowingError: No candidate can follow a path to its end.
        """
        rate = self.scenario.given.pull_to_middle
        tracks = [
            PathTrack(path, self.chains.for_freedom(path.freedom), rate)
            for path in self.scenario.paths
            if path.first in group[:-1]
        ]
        try:
            return self._follow(group, first, tracks)
        except _BlockedPathError as error:
            blocked = error
        if guided := self._follow_guided(group, first, tracks):
            return guided
        if any(track.chain.robot.virtual_joints for track in tracks):
            softened = [track._replace(chain=track.chain.with_soft_limits) for track in tracks]
            with contextlib.suppress(_BlockedPathError):
                return self._follow(group, first, softened)
        raise self._following_error(blocked)

    def _follow_guided(
        self, group: range, first: Candidates, tracks: list[PathTrack]
    ) -> GroupSolution | None:
        """Solutions with planned self-motion, from the cheapest feasible start."""
        from knotwork.robot.kinematics.following.ladder import Ladder

        moving = [track for track in tracks if not track.path.motion.is_wait]
        if self.scenario.given.pull_to_middle or len({track.path.freedom for track in moving}) != 1:
            return None
        chain = moving[0].chain
        if chain.robot.dof <= 6:
            return None
        _, rows = np.unique(first.branch, return_index=True)
        is_clear = None if self.obstacles is None else self.obstacles.are_clear
        paths = [track.path.motion for track in moving]
        ladder = Ladder(chain.robot, paths, first.q[rows][:, chain.columns], is_clear)
        for start, curves in ladder.find_guided_starts(MAX_GUIDED):
            guides = iter(curves)
            guided = [
                track if track.path.motion.is_wait else track._replace(guide=next(guides))
                for track in tracks
            ]
            branch = first.select(first.branch == first.branch[rows[start]])
            with contextlib.suppress(_BlockedPathError):
                return self._follow(group, branch, guided)
        return None

    def _follow(self, group: range, first: Candidates, tracks: list[PathTrack]) -> GroupSolution:
        candidates, followed = [first], []
        at_start = {track.path.first: track for track in tracks}
        while len(candidates) < len(group):
            track = at_start.get(group[len(candidates) - 1])
            if track is None:  # a wait
                candidates.append(candidates[-1])
                continue
            rows, onward, track = self._follow_path(track, candidates[-1])
            candidates = [waypoint.select(rows) for waypoint in candidates] + onward
            followed.append(track)
        return GroupSolution(candidates, followed)

    def _follow_path(
        self, track: PathTrack, start: Candidates
    ) -> tuple[BoolArray, list[Candidates], PathTrack]:
        """Rows that can follow a path, candidates at its waypoints after the first, and the track.

        Raises:
            _BlockedPathError: No candidate in the requested branch can.
        """
        path, robot = track.path, track.chain.robot
        q = start.q[:, track.chain.columns]
        _, firsts, branches = np.unique(start.branch, return_index=True, return_inverse=True)
        turns = q - q[firsts][branches]
        in_branch = is_in_branch(self.scenario, start)
        if not in_branch.any():  # `allowed_rows` refuses the first waypoint of the group
            in_branch = ~in_branch
        times = path.times
        pull = track.pull(float(times[0]), q[firsts[0]])
        continuation = continue_along(robot, path.motion, q[firsts], times, pull=pull)
        feasible = continuation.is_feasible(robot, branches, turns)
        contacts = self._contacts(track, continuation, sort_distinct(branches[feasible]))
        feasible &= ~np.isin(branches, list(contacts))
        if not feasible[in_branch].any():
            raise _BlockedPathError(
                track,
                continuation=continuation,
                branches=branches,
                turns=turns,
                in_branch=in_branch,
                contacts=contacts,
            )
        rows, owner, onward = start.select(feasible), branches[feasible], []
        for step in continuation.step_index[1:]:
            q = track.chain.scatter(continuation.position[step][owner] + turns[feasible])
            onward.append(
                rows._replace(
                    q=q,
                    flags=configuration_flags(self.chains.whole, q),
                    weight=1.0 + limit_nearness(self.chains.whole, q),
                    velocity=track.chain.scatter(continuation.velocity[step][owner]),
                    excess=np.zeros(len(q)),
                    unattainable=np.zeros(len(q)),
                )
            )
        return feasible, onward, track._replace(continuation=continuation)

    def _contacts(
        self, track: PathTrack, continuation: Continuation, branches: IndexArray
    ) -> dict[int, int]:
        """Step at which a continuation first collides, by its index, for those that do."""
        if self.obstacles is None:
            return {}
        count = COLLISION_SAMPLES * (GUIDED_SAMPLES_FACTOR if track.guide is not None else 1)
        steps = {int(b): self.obstacles.contact(continuation, int(b), count) for b in branches}
        return {branch: step for branch, step in steps.items() if step is not None}

    def _following_error(self, blocked: _BlockedPathError) -> FollowingError:
        """The error for a path that can't be followed.

        It names the start that gets farthest. One that is only too fast counts as farther.
        """
        path = blocked.track.path
        in_branch = np.flatnonzero(blocked.in_branch)
        untested = np.setdiff1d(blocked.branches[in_branch], list(blocked.contacts))
        contacts = {
            **blocked.contacts,
            **self._contacts(blocked.track, blocked.continuation, untested),
        }
        constraints = [self._constraint(blocked, int(row), contacts) for row in in_branch]
        best = max(constraints, key=lambda c: (c.kind == "velocity limit", c.time))
        k = next(k for k, part in enumerate(path.stretches) if best.time <= part.end)
        begin, end = (self.scenario.waypoints[path.first + k + j] for j in (0, 1))
        solution = f"the best of {len(constraints)} solutions"
        remedy = "begin a new path at a stop, before which the arm may change its branch"
        if not isinstance(self.scenario.branch, str):
            solution += " in the requested branch"
            remedy = "try branch: free"
        return make_following_error(
            path.motion,
            best,
            f"the path from {begin.name!r} can't be followed: with {solution} at "
            f"{self.scenario.waypoints[path.first].name!r},",
            f"Move the path, turn the tool, or {remedy}",
            since=begin.time,
            units=self.scenario.units,
            waypoint=end.name,
            where=end.where,
        )

    def _constraint(
        self, blocked: _BlockedPathError, row: int, contacts: Mapping[int, int]
    ) -> LimitingConstraint:
        """The earliest constraint of a candidate, or else a velocity limit, which has a remedy."""
        continuation, branch = blocked.continuation, int(blocked.branches[row])
        robot, turns = blocked.track.chain.robot, blocked.turns[row]
        limits = continuation.limiting_constraint(robot, branch, turns)
        constraints = [] if limits is None else [limits]
        if branch in contacts and self.obstacles is not None:
            constraints.append(self.obstacles.first_contact(continuation, branch, contacts[branch]))
        return min(constraints, key=lambda c: (c.kind == "velocity limit", c.time))


def track_of(tracks: Collection[PathTrack], index: int) -> PathTrack | None:
    """The track that contains a waypoint, by index, or `None`."""
    return next((t for t in tracks if t.path.first <= index <= t.path.last), None)
