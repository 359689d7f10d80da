"""Tool paths as the arm follows them: the motions of all candidates at the start of a path."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from knotwork.arrays import BoolArray, FloatArray, IndexArray
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.errors import FollowingObstruction
from knotwork.planning.task_to_joint.candidate_collisions import (
    COLLISION_SAMPLES,
    CandidateCollisions,
)
from knotwork.planning.task_to_joint.free_poses import FreedomChain
from knotwork.robot import Robot
from knotwork.robot.kinematics.chain.joint_ranges import arm_limits, whole_turns
from knotwork.robot.kinematics.following.continuation import Continuation, continue_along
from knotwork.robot.kinematics.following.joint_field import Guide, SelfMotionTarget
from knotwork.robot.kinematics.following.joints_on_path import JointsOnPath
from knotwork.robot.kinematics.geometry.configuration_flags import configuration_flags
from knotwork.robot.kinematics.sequence.candidates import Candidates
from knotwork.robot.kinematics.sequence.nearness import limit_nearness
from knotwork.task.scenario import ScenarioPath

SAME_START_DISTANCE = 1e-9
"""Distance within which two starts belong to the same continuation [rad or m]."""
GUIDED_SAMPLES_FACTOR = 4
"""Factor on the number of collision tests along planned self-motion."""


class PathTrack(NamedTuple):
    """A path, and how the arm follows it.

    Attributes:
        path: The path.
        chain: The arm with the virtual joints of the path's freedom.
        rate_to_middle: Rate at which self-motion moves joints to the middle of their ranges [1/s].
        guide: Curve that self-motion follows in place of that.
        continuation: Motions along the path from the candidates at its start, if known.
        followed: The motion from one start along the same path with any timing, if known.
    """

    path: ScenarioPath
    chain: FreedomChain
    rate_to_middle: float
    guide: Guide | None = None
    continuation: Continuation | None = None
    followed: JointsOnPath | None = None

    def self_motion_target(self, time: float, q: FloatArray) -> SelfMotionTarget:
        """Target of the self-motion at joint positions (d,) of the chain at a time [s]."""
        if self.guide is None:
            return self.rate_to_middle
        s = self.path.timed_path.arc_length(time)
        return self.guide.offset(whole_turns(q - self.guide.posture(s)))

    def joints_on_path(self, q: FloatArray) -> JointsOnPath:
        """The motion along the path from the positions of all joints [rad or m].

        Raises:
            FollowingError: The arm can't follow the path.
        """
        start, timed_path = q[self.chain.columns], self.path.timed_path
        target, continuation = self.self_motion_target(timed_path.start_time, start), None
        if self.continuation is not None:
            offsets = start - self.continuation.position[0]
            distance = np.abs(offsets - whole_turns(offsets)).max(axis=1)
            row = int(distance.argmin())
            if distance[row] <= SAME_START_DISTANCE:
                continuation = self.continuation.select(row, whole_turns(offsets[row]))
        return JointsOnPath(self.chain.robot, timed_path, start, target, continuation)


def track_of(tracks: Collection[PathTrack], index: int) -> PathTrack | None:
    """The track that contains a waypoint, by index, or `None`."""
    return next((t for t in tracks if t.path.first <= index <= t.path.last), None)


@dataclass(frozen=True, eq=False)
class CandidateMotions:
    """The motion along a path from each candidate at its start.

    Candidates of one branch differ by whole turns, and so do their motions. Thus one motion for
    each branch is computed: the continuation of its first candidate.

    Attributes:
        track: The path.
        start: The m candidates at its first waypoint.
        continuation: The motion of each branch.
        branch: Index of the branch of each candidate, shape (m,).
        turns: Offset of each candidate from the motion of its branch [rad], shape (m, d).
        collisions: Collision model of the arm and the scene, or `None`.
    """

    track: PathTrack
    start: Candidates
    continuation: Continuation
    branch: IndexArray
    turns: FloatArray
    collisions: CandidateCollisions | None
    _colliding_steps: dict[int, int | None] = field(default_factory=dict)

    @classmethod
    def along(
        cls, track: PathTrack, start: Candidates, collisions: CandidateCollisions | None
    ) -> CandidateMotions:
        """Follow a path from the candidates at its start, and ignore limits and collisions."""
        q, times = start.q[:, track.chain.columns], track.path.times
        _, firsts, branch = np.unique(start.branch, return_index=True, return_inverse=True)
        known, timed_path, starts = track.followed, track.path.timed_path, q[firsts]
        if known is not None and np.abs(known.start - starts).max() <= SAME_START_DISTANCE:
            continuation = known.with_timing(timed_path).continuation
        else:
            target = track.self_motion_target(float(times[0]), starts[0])
            continuation = continue_along(
                track.chain.robot, timed_path, starts, times, target=target
            )
        return cls(track, start, continuation, branch, q - q[firsts][branch], collisions)

    @cached_property
    def reaches_end(self) -> BoolArray:
        """Whether each candidate can follow the path to its end, shape (m,)."""
        robot = self.track.chain.robot
        within_limits = self.continuation.is_feasible(robot, self.branch, self.turns)
        branches = sort_distinct(self.branch[within_limits]).tolist()
        blocked = [branch for branch in branches if self._colliding_step(branch) is not None]
        return within_limits & ~np.isin(self.branch, blocked)

    def at_waypoints(self, whole: Robot) -> list[Candidates]:
        """The candidates that reach the end, at each waypoint of the path after the first.

        Args:
            whole: The arm with the virtual joints of all freedoms.
        """
        chain, motion, result = self.track.chain, self.continuation, []
        start = self.start.select(self.reaches_end)
        branch, turns = self.branch[self.reaches_end], self.turns[self.reaches_end]
        for step in motion.step_index[1:]:
            q = chain.scatter(motion.position[step, branch] + turns)
            candidates = start._replace(
                q=q,
                flags=configuration_flags(whole, q),
                weight=1.0 + limit_nearness(q, arm_limits(whole)),
                velocity=chain.scatter(motion.velocity[step, branch]),
                overspeed=np.zeros(len(q)),
                unattainable=np.zeros(len(q)),
            )
            result.append(candidates)
        return result

    def obstruction(self, row: int) -> FollowingObstruction:
        """The first obstruction of a candidate that does not reach the end.

        A velocity limit comes last, because it has a remedy.
        """
        branch, motion = int(self.branch[row]), self.continuation
        first = motion.obstruction(self.track.chain.robot, branch, self.turns[row])
        obstructions = [] if first is None else [first]
        step = self._colliding_step(branch)
        if self.collisions is not None and step is not None:
            obstructions.append(self.collisions.find_collision_start(motion, branch, step))
        return min(obstructions, key=lambda it: (it.cause == "velocity limit", it.time))

    def _colliding_step(self, branch: int) -> int | None:
        """Step at which the motion of a branch first collides, or `None`; tested once."""
        if self.collisions is None:
            return None
        if branch not in self._colliding_steps:
            count = COLLISION_SAMPLES * (1 if self.track.guide is None else GUIDED_SAMPLES_FACTOR)
            step = self.collisions.find_colliding_step(self.continuation, branch, count)
            self._colliding_steps[branch] = step
        return self._colliding_steps[branch]
