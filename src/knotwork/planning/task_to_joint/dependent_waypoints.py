"""Waypoints whose solutions follow from the previous one: along tool paths and during waits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from knotwork.arrays import IndexArray
from knotwork.errors import FollowingError
from knotwork.errors.plain_text import quoted_waypoint
from knotwork.planning.task_to_joint.candidate_collisions import CandidateCollisions
from knotwork.planning.task_to_joint.free_poses import FreedomChains
from knotwork.planning.task_to_joint.path_track import CandidateMotions, PathTrack
from knotwork.planning.task_to_joint.requested_branch import is_in_branch, require_branch
from knotwork.robot.kinematics.following.obstruction import make_following_error
from knotwork.robot.kinematics.sequence.candidates import Candidates
from knotwork.task.scenario import Scenario

MAX_GUIDED = 12
"""If no candidate can follow the paths with least-norm joint velocities, planned self-motion
(`Ladder`) is tried from this number of branches, the cheapest first, until one succeeds.
"""


def dependent_groups(scenario: Scenario, rest_intervals: Sequence[int]) -> list[range]:
    """Groups of consecutive waypoints that follow from the first of the group.

    Args:
        scenario: The scenario.
        rest_intervals: Intervals over which the arm rests.
    """
    dependent = {i + 1 for i in rest_intervals}
    for path in scenario.paths:
        dependent.update(range(path.first + 1, path.last + 1))
    previous = {i - 1 for i in dependent}
    ends = zip(sorted(previous - dependent), sorted(dependent - previous), strict=True)
    return [range(first, last + 1) for first, last in ends]


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
    """No candidate in the requested branch can follow a path.

    Attributes:
        motions: The motions of the candidates along the path.
        rows: Indices of the candidates in the requested branch.
    """

    motions: CandidateMotions
    rows: IndexArray


@dataclass(frozen=True, eq=False)
class GroupSolver:
    """Finds the candidates at dependent waypoints, from those at the first of their group.

    Attributes:
        scenario: The scenario.
        chains: The robot with the virtual joints of each pose.
        collisions: Collision model of the arm and the scene, or `None`.
        earlier_tracks: Tracks of the same task with other speeds along its paths, by index of their
            first waypoint.
    """

    scenario: Scenario
    chains: FreedomChains
    collisions: CandidateCollisions | None
    earlier_tracks: Mapping[int, PathTrack]

    def solve(self, group: range, first: Candidates) -> GroupSolution:
        """Find the candidates that can follow a group from its first waypoint to its end.

        If there are none, self-motion is planned, and then virtual joints that slow down before
        their limits are used.

        Raises:
            BranchError: No candidate at the first waypoint is in the requested branch.
            FollowingError: No candidate in this branch can follow a path to its end.
        """
        require_branch(self.scenario, self.chains.arm_with_freedoms, group[0], first)
        blocked = []
        for candidates, tracks in self._attempts(group, first):
            try:
                return self._follow(group, candidates, tracks)
            except _BlockedPathError as error:
                blocked.append(error)
        raise self._following_error(blocked[0])

    def _attempts(
        self, group: range, first: Candidates
    ) -> Iterator[tuple[Candidates, list[PathTrack]]]:
        """Candidates at the first waypoint, and the tracks they may follow, the best first."""
        rate = self.scenario.task.pull_to_middle
        tracks = [
            PathTrack(path, self.chains.for_freedom(path.freedom), rate)
            for path in self.scenario.paths
            if path.first in group[:-1]
        ]
        depends_on_time = rate or any(track.path.timed_path.has_own_clock for track in tracks)
        if self.earlier_tracks and len(first.q) == 1 and not depends_on_time:
            yield first, [self.earlier_tracks[t.path.first]._replace(path=t.path) for t in tracks]
        yield first, tracks
        yield from self._guided(first, tracks)
        if any(track.chain.robot.virtual_joints for track in tracks):
            yield first, [track._replace(chain=track.chain.with_soft_limits) for track in tracks]

    def _guided(
        self, first: Candidates, tracks: list[PathTrack]
    ) -> Iterator[tuple[Candidates, list[PathTrack]]]:
        """Candidates of one branch, and tracks with self-motion planned for it, the cheapest first.

        There are none if the arm is not redundant, or if self-motion is given.
        """
        from knotwork.robot.kinematics.following.ladder import Ladder

        moving = [track for track in tracks if not track.path.timed_path.is_wait]
        if self.scenario.task.pull_to_middle or len({track.path.freedom for track in moving}) != 1:
            return
        chain = moving[0].chain
        if not chain.robot.is_redundant:
            return
        branches, rows = np.unique(first.branch, return_index=True)
        is_clear = None if self.collisions is None else self.collisions.are_clear
        paths = [track.path.timed_path for track in moving]
        ladder = Ladder(chain.robot, paths, first.q[rows][:, chain.columns], is_clear)
        for start, curves in ladder.find_guided_starts(MAX_GUIDED):
            guides = iter(curves)
            guided = [
                track if track.path.timed_path.is_wait else track._replace(guide=next(guides))
                for track in tracks
            ]
            yield first.select(first.branch == branches[start]), guided

    def _follow(self, group: range, first: Candidates, tracks: list[PathTrack]) -> GroupSolution:
        """Follow the paths and waits of a group with the candidates at its first waypoint.

        Raises:
            _BlockedPathError: No candidate in the requested branch can.
        """
        candidates, followed = [first], []
        at_start = {track.path.first: track for track in tracks}
        while len(candidates) < len(group):
            track = at_start.get(group[len(candidates) - 1])
            if track is None:  # a wait
                candidates.append(candidates[-1])
                continue
            motions = CandidateMotions.along(track, candidates[-1], self.collisions)
            in_branch = is_in_branch(self.scenario, candidates[0])
            if not (motions.reaches_end & in_branch).any():
                raise _BlockedPathError(motions, np.flatnonzero(in_branch))
            candidates = [waypoint.select(motions.reaches_end) for waypoint in candidates]
            candidates += motions.at_waypoints(self.chains.arm_with_freedoms)
            followed.append(track._replace(continuation=motions.continuation))
        return GroupSolution(candidates, followed)

    def _following_error(self, blocked: _BlockedPathError) -> FollowingError:
        """The error for a path that can't be followed.

        It names the start that gets farthest. One that is only too fast counts as farther.
        """
        path = blocked.motions.track.path
        obstructions = [blocked.motions.obstruction(row) for row in blocked.rows.tolist()]
        best = max(obstructions, key=lambda it: (it.cause == "velocity limit", it.time))
        k = next(k for k, part in enumerate(path.stretches) if best.time <= part.end)
        begin, end = (self.scenario.waypoints[path.first + k + j] for j in (0, 1))
        begin_name, end_name, first_name = (
            quoted_waypoint(it.name) for it in (begin, end, self.scenario.waypoints[path.first])
        )
        solution = f"the best of {len(obstructions)} solutions"
        other_start = "a new path from a stop, before which the arm may change its branch"
        if not isinstance(self.scenario.branch, str):
            solution += " in the requested branch"
            other_start = "branch: free"
        error = make_following_error(
            path.timed_path,
            best,
            f"the path from {begin_name} to {end_name} can't be followed, even with {solution} at "
            f"{first_name}",
            f"another path or orientation of the tool, or {other_start}",
            since=begin.time,
            units=self.scenario.units,
            waypoint=end.name,
            where=end.where,
        )
        error.path_start = path.first
        return error
