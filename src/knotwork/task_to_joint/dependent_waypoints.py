"""Waypoints whose solutions follow from the previous one: along tool paths and during waits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

import numpy as np

from knotwork.errors import FollowingError
from knotwork.kinematics.chain.joint_ranges import whole_turns
from knotwork.kinematics.following.continuation import Continuation, continue_along
from knotwork.kinematics.following.joint_field import Guide, Pull
from knotwork.kinematics.following.limiting_constraint import LimitingConstraint, following_error
from knotwork.kinematics.geometry.configuration_flags import configuration_flags
from knotwork.kinematics.sequence.candidates import Candidates
from knotwork.kinematics.sequence.nearness import limit_nearness
from knotwork.polynomial.distinct import distinct
from knotwork.robot import Robot
from knotwork.scenario import Scenario, ScenarioPath
from knotwork.task_to_joint.branches import branch_names, is_in_branch
from knotwork.task_to_joint.free_poses import Chain, Chains
from knotwork.task_to_joint.obstacles import PATH_SAMPLES, Obstacles
from knotwork.task_to_joint.solution import PathStart
from knotwork.waypoints import FloatArray

# Starts within this distance belong to the same continuation [rad or m].
SAME_START = 1e-9
# If no candidate can follow the paths with least-norm joint velocities, planned self-motion
# (`Ladder`) is tried from `MAX_GUIDED` branches, the cheapest first, until `ENOUGH_GUIDED` succeed.
MAX_GUIDED, ENOUGH_GUIDED = 12, 3
# Factor on the number of collision tests along planned self-motion.
GUIDED_SAMPLES_FACTOR = 4
# Fields of `Candidates` with one row per candidate.
ROW_FIELDS = ("q", "branch", "flags", "excess", "weight", "velocity", "lost")

Blocked = Callable[[], FollowingError]


@dataclass(frozen=True, eq=False)
class DependentWaypoints:
    """Waypoints that follow from the previous one.

    Attributes:
        scenario: The task.
        waits: Indices of the waypoints where a wait begins; the next waypoint is equal.
        chains: The robot with the virtual joints of each pose.
        obstacles: Collision model of the arm and the scene, or `None`.
    """

    scenario: Scenario
    waits: tuple[int, ...]
    chains: Chains
    obstacles: Obstacles | None = None
    _continuations: dict[int, Continuation] = field(default_factory=dict, repr=False)
    _guides: dict[int, list[Guide]] = field(default_factory=dict, repr=False)
    _softened: dict[int, Chain] = field(default_factory=dict, repr=False)

    def pull(self, path: ScenarioPath, time: float, q: FloatArray) -> Pull:
        """Target of the self-motion along a path, for given joint positions at a time.

        Args:
            path: The path.
            time: Time [s].
            q: Positions of the joints that move along the path [rad or m], shape (d,).
        """
        guides = self._guides.get(path.first)
        if not guides:
            return self.scenario.task.pull_to_middle
        gaps = q - np.array([one.at(path.motion.arc_length(time)) for one in guides])
        nearest = int(np.abs(gaps - whole_turns(gaps)).max(axis=1).argmin())
        return guides[nearest].turned(whole_turns(gaps[nearest]))

    def chain(self, path: ScenarioPath) -> Chain:
        """Arm with the virtual joints of a path's freedom."""
        return self._softened.get(path.first) or self.chains.of(path.freedom)

    def start(self, path: ScenarioPath, q: FloatArray) -> PathStart:
        """Start of a path, from the positions of all joints [rad or m]."""
        chain = self.chain(path)
        own = q[chain.columns]
        return PathStart(chain.robot, own, self.pull(path, path.motion.start_time, own))

    @property
    def groups(self) -> list[range]:
        """Groups of consecutive waypoints that follow from the first of the group."""
        after = {i + 1 for i in self.waits}
        for path in self.scenario.paths:
            after.update(range(path.first + 1, path.last + 1))
        groups: list[range] = []
        for i in sorted(after):
            if groups and groups[-1].stop == i:
                groups[-1] = range(groups[-1].start, i + 1)
            else:
                groups.append(range(i - 1, i + 1))
        return groups

    @property
    def independent(self) -> list[int]:
        """Indices of the waypoints that do not follow from a previous one."""
        tied = {i for group in self.groups for i in group[1:]}
        return sorted({*range(len(self.scenario.waypoints))} - tied)

    def complete(self, candidates: list[Candidates | None]) -> list[Candidates | None]:
        """Candidates at all waypoints, from the candidates at the independent ones.

        Candidates that reach the end of their group are kept. Row k of each waypoint in a group
        follows from row k of the previous waypoint.

        Raises:
            FollowingError: No candidate can follow a path to its end.
        """
        result = list(candidates)
        for group in self.groups:
            first = result[group[0]]
            if first is None:
                continue
            for i, one in zip(group, self._group_candidates(group, first), strict=True):
                result[i] = one
        return result

    def _group_candidates(self, group: range, first: Candidates) -> list[Candidates]:
        """Candidates at the waypoints of a group, with planned self-motion where it is needed."""
        led = self._continue_group(group, first)
        if isinstance(led, list):
            return led
        found: list[list[Candidates]] = []
        moving = (path for path in self.scenario.paths if not path.motion.stands)
        paths = [path for path in moving if path.first in group[:-1]]
        if not paths:
            raise led()
        alike = len({path.freedom for path in paths}) == 1
        chain = self.chains.of(paths[0].freedom)
        if alike and chain.robot.dof > 6 and not self.scenario.task.pull_to_middle:
            found = list(islice(self._continue_guided(chain, paths, group, first), ENOUGH_GUIDED))
        if found:
            return [concatenate(ones) for ones in zip(*found, strict=True)]
        # a bounded turn goes straight into its limit: now it slows down before
        hard = [path for path in paths if self.chain(path).is_hard]
        self._softened.update((path.first, self.chain(path).softened) for path in hard)
        if hard and isinstance(soft := self._continue_group(group, first), list):
            return soft
        self._softened.clear()
        raise led()

    def _continue_guided(
        self, chain: Chain, paths: list[ScenarioPath], group: range, first: Candidates
    ) -> Iterator[list[Candidates]]:
        """Candidates of a group with planned self-motion, for one feasible start after another."""
        from knotwork.kinematics.following.ladder import Ladder

        _, own = np.unique(first.branch, return_index=True)
        clear = None if self.obstacles is None else self.obstacles.clear
        starts = first.q[own][:, chain.columns]
        ladder = Ladder(chain.robot, [path.motion for path in paths], starts, clear)
        for start, guides in islice(ladder.ways(), MAX_GUIDED):
            known = dict(self._guides)
            self._guides.update(
                (path.first, [one]) for path, one in zip(paths, guides, strict=True)
            )
            rows = np.flatnonzero(first.branch == first.branch[own[start]])
            found = self._continue_group(group, select_rows(first, rows))
            leads = isinstance(found, list)
            for path, one in zip(paths, guides, strict=True):
                self._guides[path.first] = known.get(path.first, []) + [one] * leads
            if isinstance(found, list):
                yield found

    def _continue_group(self, group: range, first: Candidates) -> list[Candidates] | Blocked:
        """Continue candidates through a group, or give the factory of the error that stops them."""
        chain = [first]
        paths = {path.first: path for path in self.scenario.paths}
        i = group[0]
        while i < group[-1]:
            path = paths.get(i)
            if path is None:
                chain.append(chain[-1])
                i += 1
                continue
            found = self._continue_along(path, chain[-1])
            if not isinstance(found, tuple):
                return found
            kept, onward = found
            chain = [select_rows(one, kept) for one in chain] + onward
            i = path.last
        return chain

    def _continue_along(
        self, path: ScenarioPath, start: Candidates
    ) -> tuple[Any, list[Candidates]] | Blocked:
        """Rows that can follow a path, and the candidates at its waypoints after the first."""
        chain = self.chain(path)
        robot, q = chain.robot, start.q[:, chain.columns]
        _, own, back = np.unique(start.branch, return_index=True, return_inverse=True)
        times = np.array([path.stretches[0].start, *(one.end for one in path.stretches)])
        turns = q - q[own][back]
        asked = is_in_branch(self.scenario, start)
        tried = np.flatnonzero(asked if asked.any() else ~asked)
        pull = self.pull(path, float(times[0]), q[own[0]])
        found = continue_along(robot, path.motion, q[own], times, pull=pull)
        free = found.free(robot, back, turns)
        looks = GUIDED_SAMPLES_FACTOR * PATH_SAMPLES if isinstance(pull, Guide) else PATH_SAMPLES
        contacts = self._contacts(found, distinct(back[free]), looks)
        free &= ~np.isin(back, list(contacts))
        self._continuations[path.first] = found

        def blocked() -> FollowingError:
            every = contacts | self._contacts(found, np.setdiff1d(back[tried], list(contacts)))
            collisions = self._collisions(found, every)
            constraints = [
                _first(
                    found.limiting_constraint(robot, int(back[i]), turns[i]),
                    collisions.get(int(back[i])),
                )
                for i in tried
            ]
            others = branch_names(self.chains.whole, select_rows(start, free))
            return self._blocked(robot, path, select_rows(start, tried), constraints, others)

        if not free[tried].any():
            return blocked
        kept = np.flatnonzero(free)
        return kept, [
            self._candidates(chain, path, start, found, kept, back, turns, k)
            for k in range(1, len(times))
        ]

    def known_continuation(self, path: ScenarioPath, start: FloatArray) -> Continuation | None:
        """The continuation along a path from joint positions (d,), if it has been computed."""
        if (found := self._continuations.get(path.first)) is None:
            return None
        turns = whole_turns(start - found.q[0])
        off = np.abs(start - found.q[0] - turns).max(axis=1)
        own = int(off.argmin())
        return found.taken(own, turns[own]) if off[own] <= SAME_START else None

    def _contacts(
        self, found: Continuation, ways: Any, count: int = PATH_SAMPLES
    ) -> dict[int, int]:
        """Step of the first collision of each continuation that has one, by index of its start."""
        if self.obstacles is None:
            return {}
        contacts = {int(b): self.obstacles.contact(found, int(b), count) for b in ways}
        return {b: steps for b, steps in contacts.items() if steps is not None}

    def _collisions(
        self, found: Continuation, contacts: Mapping[int, int]
    ) -> dict[int, LimitingConstraint]:
        """Collisions as limiting constraints, by start."""
        if self.obstacles is None:
            return {}
        found_at = {b: self.obstacles.describe_contact(found, b, k) for b, k in contacts.items()}
        return {
            b: LimitingConstraint("collision", time, 0, 0.0, 0.0, 0.0, contact=text)
            for b, (time, text) in found_at.items()
        }

    def _candidates(
        self,
        chain: Chain,
        path: ScenarioPath,
        start: Candidates,
        found: Continuation,
        kept: Any,
        back: Any,
        turns: FloatArray,
        k: int,
    ) -> Candidates:
        row = int(np.abs(found.time - path.stretches[k - 1].end).argmin())
        q = chain.put(found.q[k][back[kept]] + turns[kept])
        robot = self.chains.whole
        return select_rows(start, kept)._replace(
            q=q,
            flags=configuration_flags(robot, q),
            weight=1.0 + limit_nearness(robot, q),
            velocity=chain.put(found.velocity[row][back[kept]]),
            excess=np.zeros(len(kept)),
            lost=np.zeros(len(kept), dtype=bool),
        )

    def _blocked(
        self,
        robot: Robot,
        path: ScenarioPath,
        start: Candidates,
        constraints: list[LimitingConstraint],
        others: tuple[str, ...],
    ) -> FollowingError:
        """The error for a path that can't be followed.

        It names the start for which a lower speed is sufficient, or else the start that gets
        farthest; and the branches that can follow the path, if another was asked for.
        """
        index, best = max(
            enumerate(constraints),
            key=lambda pair: (pair[1].part or 0.0, pair[1].time),
        )
        k = next(k for k, one in enumerate(path.stretches) if best.time <= one.end)
        begin, end = (self.scenario.waypoints[path.first + k + j] for j in (0, 1))
        first, count = self.scenario.waypoints[path.first], len(constraints)
        tried = "the only solution" if count == 1 else f"the best of all {count} solutions"
        if not isinstance(self.scenario.branch, str):
            tried += " in the branch asked for"
        words = "".join(
            f" ({name})" for name in branch_names(self.chains.whole, select_rows(start, [index]))
        )
        remedy = "begin a new path at a stop, before which the arm may change its branch"
        if others:
            remedy = f"ask for a branch that leads along it: {'; or '.join(others)}"
        remedy = f"Move the path, turn the tool, or {remedy}"
        return following_error(
            robot,
            path.motion,
            best,
            f"the path from {begin.name!r} can't be followed: with {tried} at {first.name!r}"
            f"{words},",
            remedy,
            since=begin.time,
            units=self.scenario.units,
            waypoint=end.name,
            where=end.where,
        )


def _first(
    other: LimitingConstraint | None, contact: LimitingConstraint | None
) -> LimitingConstraint:
    """The earliest constraint; a velocity limit comes last, because a lower speed meets it.

    Args:
        other: A limit or a singularity, or `None`.
        contact: A collision, or `None` where there is another limiting constraint.
    """
    both = [one for one in (other, contact) if one is not None]
    return min(both, key=lambda one: (one.kind == "velocity limit", one.time))


def select_rows(candidates: Candidates, rows: Any) -> Candidates:
    """Candidates at the given row indices."""
    return candidates._replace(**{key: getattr(candidates, key)[rows] for key in ROW_FIELDS})


def concatenate(several: Sequence[Candidates]) -> Candidates:
    """Candidates of several arrays of rows as one."""
    columns: dict[str, Any] = {
        key: np.concatenate([getattr(one, key) for one in several]) for key in ROW_FIELDS
    }
    return several[0]._replace(**columns)
