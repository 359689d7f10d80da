"""Waypoints whose solutions follow from those before: along tool paths, and where the arm waits."""

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
from knotwork.task_to_joint.branches import described, in_branch
from knotwork.task_to_joint.free_poses import Chain, Chains
from knotwork.task_to_joint.obstacles import LOOKS, Obstacles
from knotwork.task_to_joint.solution import PathStart
from knotwork.waypoints import FloatArray

# Joint positions that differ by no more than this are those of one way [rad or m].
SAME = 1e-9
# Where self-motion leads nowhere by itself, ways up a ladder are tried from starts of different
# branches, the cheapest first, until some lead along the paths.
TRIED, LEADING = 12, 3
# Such self-motion is looked at more closely for collisions.
CLOSER = 4
# What candidates have one of each.
OF_EACH = ("q", "branch", "flags", "excess", "weight", "velocity", "lost")

Blocked = Callable[[], FollowingError]


@dataclass(frozen=True, eq=False)
class DependentWaypoints:
    """Which waypoints follow from the one before.

    Attributes:
        scenario: The task.
        waits: Waypoints with an equal one after them, by index.
        chains: The robot with the virtual joints of each pose.
        obstacles: What the arm may collide with, or `None`.
    """

    scenario: Scenario
    waits: tuple[int, ...]
    chains: Chains
    obstacles: Obstacles | None = None
    _ways: dict[int, Continuation] = field(default_factory=dict, repr=False)
    _guides: dict[int, list[Guide]] = field(default_factory=dict, repr=False)

    def pull(self, path: ScenarioPath, time: float, q: FloatArray) -> Pull:
        """What self-motion follows along a path of an arm that is somewhere at a time.

        Args:
            path: The path.
            time: When [s].
            q: Positions of the joints that move along the path [rad or m], shape (d,).
        """
        guides = self._guides.get(path.first)
        if not guides:
            return self.scenario.pull_to_middle
        gaps = q - np.array([one.at(path.motion.arc_length(time)) for one in guides])
        nearest = int(np.abs(gaps - whole_turns(gaps)).max(axis=1).argmin())
        return guides[nearest].turned(whole_turns(gaps[nearest]))

    def start(self, path: ScenarioPath, q: FloatArray) -> PathStart:
        """How the arm comes onto a path from positions of all joints [rad or m]."""
        chain = self.chains.of(path.freedom)
        own = q[chain.columns]
        return PathStart(chain.robot, own, self.pull(path, path.motion.start_time, own))

    @property
    def groups(self) -> list[range]:
        """Runs of waypoints that follow from their first."""
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
    def free(self) -> list[int]:
        """Waypoints that don't follow from one before, by index."""
        tied = {i for group in self.groups for i in group[1:]}
        return [i for i in range(len(self.scenario.waypoints)) if i not in tied]

    def completed(self, candidates: list[Candidates | None]) -> list[Candidates | None]:
        """Candidates at all waypoints, from those at the waypoints that are free.

        Those that lead through a whole group are kept. Row k of each waypoint in a group follows
        from row k of the waypoint before.

        Raises:
            FollowingError: None leads along a path.
        """
        result = list(candidates)
        for group in self.groups:
            first = result[group[0]]
            if first is None:
                continue
            for i, one in zip(group, self._chain(group, first), strict=True):
                result[i] = one
        return result

    def _chain(self, group: range, first: Candidates) -> list[Candidates]:
        """Candidates at the waypoints of a group; where none lead, those that are guided."""
        led = self._led(group, first)
        if isinstance(led, list):
            return led
        found = []
        moves = (one for one in self.scenario.paths if not one.motion.stands)
        paths = [one for one in moves if one.first in group[:-1]]
        if not paths:
            raise led()
        alike = len({path.freedom for path in paths}) == 1
        chain = self.chains.of(paths[0].freedom)
        if alike and chain.robot.dof > 6 and not self.scenario.pull_to_middle:
            found = list(islice(self._guided(chain, paths, group, first), LEADING))
        if not found:
            raise led()
        return [joined(ones) for ones in zip(*found, strict=True)]

    def _guided(
        self, chain: Chain, paths: list[ScenarioPath], group: range, first: Candidates
    ) -> Iterator[list[Candidates]]:
        """Candidates at the waypoints of a group, of one start after the other that is guided."""
        from knotwork.kinematics.following.ladder import Ladder

        _, own = np.unique(first.branch, return_index=True)
        clear = None if self.obstacles is None else self.obstacles.clear
        starts = first.q[own][:, chain.columns]
        ladder = Ladder(chain.robot, [path.motion for path in paths], starts, clear)
        for start, guides in islice(ladder.ways(), TRIED):
            known = dict(self._guides)
            self._guides.update(
                (path.first, [one]) for path, one in zip(paths, guides, strict=True)
            )
            rows = np.flatnonzero(first.branch == first.branch[own[start]])
            found = self._led(group, taken(first, rows))
            leads = isinstance(found, list)
            for path, one in zip(paths, guides, strict=True):
                self._guides[path.first] = known.get(path.first, []) + [one] * leads
            if isinstance(found, list):
                yield found

    def _led(self, group: range, first: Candidates) -> list[Candidates] | Blocked:
        """Candidates at the waypoints of a group, or what makes the error where none lead on."""
        chain = [first]
        paths = {path.first: path for path in self.scenario.paths}
        i = group[0]
        while i < group[-1]:
            path = paths.get(i)
            if path is None:
                chain.append(chain[-1])
                i += 1
                continue
            found = self._along(path, chain[-1])
            if not isinstance(found, tuple):
                return found
            kept, onward = found
            chain = [taken(one, kept) for one in chain] + onward
            i = path.last
        return chain

    def _along(
        self, path: ScenarioPath, start: Candidates
    ) -> tuple[Any, list[Candidates]] | Blocked:
        """Rows that lead along a path, and the candidates at its waypoints after the first."""
        chain = self.chains.of(path.freedom)
        robot, q = chain.robot, start.q[:, chain.columns]
        _, own, back = np.unique(start.branch, return_index=True, return_inverse=True)
        times = np.array([path.stretches[0].start, *(one.end for one in path.stretches)])
        turns = q - q[own][back]
        asked = in_branch(self.scenario, start)
        tried = np.flatnonzero(asked if asked.any() else ~asked)
        pull = self.pull(path, float(times[0]), q[own[0]])
        found = continue_along(robot, path.motion, q[own], times, pull=pull)
        free = found.free(robot, back, turns)
        looks = CLOSER * LOOKS if isinstance(pull, Guide) else LOOKS
        contacts = self._contacts(found, distinct(back[free]), looks)
        free &= ~np.isin(back, list(contacts))
        self._ways[path.first] = found

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
            others = described(self.chains.whole, taken(start, free))
            return self._blocked(robot, path, taken(start, tried), constraints, others)

        if not free[tried].any():
            return blocked
        kept = np.flatnonzero(free)
        return kept, [
            self._candidates(chain, path, start, found, kept, back, turns, k)
            for k in range(1, len(times))
        ]

    def way(self, path: ScenarioPath, start: FloatArray) -> Continuation | None:
        """The way along a path from joint positions (d,), if it has been looked at."""
        found = self._ways.get(path.first)
        if found is None:
            return None
        turns = whole_turns(start - found.q[0])
        off = np.abs(start - found.q[0] - turns).max(axis=1)
        own = int(off.argmin())
        return found.taken(own, turns[own]) if off[own] <= SAME else None

    def _contacts(self, found: Continuation, ways: Any, looks: int = LOOKS) -> dict[int, int]:
        """The first collisions of ways that have any, by their starts' indices."""
        if self.obstacles is None:
            return {}
        contacts = {int(b): self.obstacles.contact(found, int(b), looks) for b in ways}
        return {b: steps for b, steps in contacts.items() if steps is not None}

    def _collisions(
        self, found: Continuation, contacts: Mapping[int, int]
    ) -> dict[int, LimitingConstraint]:
        """Collisions as limiting constraints, by start."""
        if self.obstacles is None:
            return {}
        collisions = {b: self.obstacles.described(found, b, steps) for b, steps in contacts.items()}
        return {
            b: LimitingConstraint("collision", time, 0, 0.0, 0.0, 0.0, contact=text)
            for b, (time, text) in collisions.items()
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
        return taken(start, kept)._replace(
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

        It names the start for which a lower speed is sufficient, if there is one, and else the one
        which leads farthest; and the branches that lead along the path, if another was asked
        for.
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
            f" ({name})" for name in described(self.chains.whole, taken(start, [index]))
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
    """The first constraint; a velocity limit comes last, as a lower speed meets it.

    Args:
        other: A limit or a singularity, or `None`.
        contact: A collision, or `None` where there is another limiting constraint.
    """
    both = [one for one in (other, contact) if one is not None]
    return min(both, key=lambda one: (one.kind == "velocity limit", one.time))


def taken(candidates: Candidates, rows: Any) -> Candidates:
    """Some of the candidates."""
    return candidates._replace(**{key: getattr(candidates, key)[rows] for key in OF_EACH})


def joined(several: Sequence[Candidates]) -> Candidates:
    """Several as one."""
    columns: dict[str, Any] = {
        key: np.concatenate([getattr(one, key) for one in several]) for key in OF_EACH
    }
    return several[0]._replace(**columns)
