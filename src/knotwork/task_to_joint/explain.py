"""Saying which solutions were chosen and why, and what no choice can do."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from knotwork.kinematics.geometry.configuration_flags import configuration_flags, describe_flags
from knotwork.kinematics.sequence.candidates import Candidates
from knotwork.kinematics.sequence.choice import positions_of
from knotwork.kinematics.sequence.costs import AT_LIMIT
from knotwork.task_to_joint.search import Found, Search
from knotwork.task_to_joint.solution import Alternative, Choice, Infeasibility
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from knotwork.kinematics.sequence.alternatives import AlternativeSequence


class Explanation:
    """Reasons for a choice of solutions, and its alternatives.

    Args:
        search: The search.
        found: What it found.
    """

    def __init__(self, search: Search, found: Found) -> None:
        self.search, self.found = search, found
        self.scenario, self.robot = search.scenario, search.robot
        self.names = [waypoint.name for waypoint in self.scenario.waypoints]

    def choices(self) -> tuple[Choice, ...]:
        """The solution chosen at each waypoint that is given by a pose."""
        alternatives = self._alternatives()
        result = []
        signs = configuration_flags(self.robot, self.found.positions)
        for i, candidates in enumerate(self.search.candidates):
            if candidates is None:
                continue
            q = self.found.positions[i]
            result.append(
                Choice(
                    waypoint=self.names[i],
                    branch=describe_flags(self.robot, signs[i]),
                    turns=self._turns(q),
                    branches=candidates.branches,
                    solutions=len(candidates.q),
                    sampled=candidates.free,
                    reason="nearest to its near"
                    if i in self.search.space.solutions
                    else self._reason(candidates, (signs[: i + 1] * signs[i] < 0).any()),
                    alternative=None if candidates.free else alternatives[i],
                )
            )
        return tuple(result)

    def infeasibilities(self) -> tuple[Infeasibility, ...]:
        """Intervals and waypoints that exceed a velocity limit whatever is chosen."""
        faults: dict[int, list[tuple[int, float]]] = {}
        for i, j, move in self._too_fast(self.found.positions):
            faults.setdefault(i, []).append((j, move / float(self.search.durations[i])))
        found = [self._interval(i, speeds) for i, speeds in faults.items()]
        for i, candidates in enumerate(self.search.candidates):
            if candidates is not None and i not in self.search.unsped:
                v = np.abs(self.found.velocities[i])
                fast = np.flatnonzero(v > self.robot.velocity_limit * AT_LIMIT)
                if fast.size:
                    found.append(self._waypoint(i, [(int(j), float(v[j])) for j in fast]))
        return tuple(found)

    def _too_fast(self, positions: FloatArray) -> list[tuple[int, int, float]]:
        """Interval, joint and distance where a mean speed is beyond its limit."""
        move = np.abs(np.diff(positions, axis=0))
        if self.search.rules.untimed is not None:
            move[self.search.rules.untimed] = 0.0
        most = self.robot.velocity_limit * self.search.durations[:, None] * AT_LIMIT
        return [(int(i), int(j), float(move[i, j])) for i, j in np.argwhere(move > most)]

    def _interval(self, i: int, speeds: list[tuple[int, float]]) -> Infeasibility:
        duration = self.search.durations[i]
        longest = duration * max(v / self.robot.velocity_limit[j] for j, v in speeds)
        sentence = (
            f"from {self.names[i]!r} to {self.names[i + 1]!r} {self._needs(speeds)} on average; "
            f"{self._others}; {longest:.4g} s or more would do for the mean, and they have "
            f"{duration:.4g} s"
        )
        return self._infeasibility(i, i + 1, speeds, sentence)

    def _waypoint(self, i: int, speeds: list[tuple[int, float]]) -> Infeasibility:
        part = min(self.robot.velocity_limit[j] / v for j, v in speeds)
        sentence = (
            f"at {self.names[i]!r} {self._needs(speeds)} for the tool's velocity; "
            f"{self._others}; at {part:.3g} of that velocity it could be done"
        )
        return self._infeasibility(i, i, speeds, sentence)

    def _infeasibility(
        self, first: int, last: int, speeds: list[tuple[int, float]], sentence: str
    ) -> Infeasibility:
        limit, times = self.robot.velocity_limit, self.scenario.times
        joint, velocity = max(speeds, key=lambda fault: fault[1] / limit[fault[0]])
        return Infeasibility(
            waypoint=self.names[first],
            until=self.names[last] if last > first else "",
            start=float(times[first]),
            end=float(times[last]),
            joint=self.robot.joint_names[joint],
            velocity=velocity,
            limit=float(limit[joint]),
            unit=f"{self.robot.joint_units[joint]}/s",
            sentence=sentence,
        )

    @cached_property
    def _others(self) -> str:
        """The effect of other choices of solutions, in words."""
        asked = self.scenario.branch != "free"
        if asked and self.search.feasible_if_free():
            return "in another branch it can be done (branch: free)"
        if any(c is not None and c.free for c in self.search.candidates):
            return "no other of the solutions tried breaks limits by less"
        return f"no other choice{' in the branch asked for' if asked else ''} breaks limits by less"

    def _needs(self, speeds: list[tuple[int, float]]) -> str:
        """The joints that are too fast, the worst of them first."""
        limit = self.robot.velocity_limit
        ordered = sorted(speeds, key=lambda fault: -fault[1] / limit[fault[0]])
        return ", ".join(self._speed(j, v, " needs", ".4g") for j, v in ordered)

    def _reason(self, candidates: Candidates, changed: bool) -> str:
        if len(candidates.q) == 1:
            return "the only solution"
        feasible = int((candidates.lost + candidates.excess == 0.0).sum())
        wanted = self.scenario.branch
        if isinstance(wanted, str):
            kept = ", branch changed for the speeds" if changed else ", branch kept"
            asked = {"free": "", "keep": kept, "fixed": ", branch fixed"}[wanted]
        else:
            asked = ", branch as asked"
        if self.found.sequence.cost.infeasible > 0.0:
            return f"least beyond the velocity limits{asked}"
        aim = "nearest to near" if self.search.near is not None else "least travel"
        if self.scenario.prefers_clearance:
            aim = "most clearance"
        elif candidates.free and self.robot.dof > 6 and self.search.near is None:
            aim = "least travel, and clear of limits and singularities"
        left = len(candidates.q) - feasible
        fast = f"; {left} too fast for the joints" if left else ""
        return f"{aim}{asked}{fast}"

    def _turns(self, q: FloatArray) -> tuple[tuple[str, int], ...]:
        turns = np.round(q / (2 * np.pi)).astype(int)
        joints = zip(self.robot.joint_names, turns, self.robot.joint_units, strict=True)
        return tuple((name, int(turn)) for name, turn, unit in joints if turn and unit == "rad")

    def _alternatives(self) -> list[Alternative | None]:
        """The best other sequence for each waypoint: another branch there, else other turns."""
        from knotwork.kinematics.sequence.alternatives import find_alternatives

        search, chosen = self.search, self.found.sequence
        apart = [c is not None and not c.free for c in search.candidates]
        branches = [
            c.branch[rows] if c is not None and distinct else np.zeros(len(layer.q), dtype=int)
            for layer, c, rows, distinct in zip(
                search.layers, search.candidates, search.rows, apart, strict=True
            )
        ]
        problem = search.layers, search.durations, search.rules, chosen, branches
        found = find_alternatives(*problem)
        alone = [
            one is None and distinct and len(layer.q) > 1
            for one, distinct, layer in zip(found, apart, search.layers, strict=True)
        ]
        if any(alone):
            turned = find_alternatives(*problem, turns=True)
            found = [b if use else a for a, b, use in zip(found, turned, alone, strict=True)]
        return [
            self._alternative(i, one) if one is not None and apart[i] else None
            for i, one in enumerate(found)
        ]

    def _alternative(self, i: int, other: AlternativeSequence) -> Alternative:
        least, cost = self.found.sequence.cost, other.cost
        q = self._positions(other)[i]
        branch = describe_flags(self.robot, configuration_flags(self.robot, q[None])[0])
        hindrance, extra = "", None
        if cost.collisions > least.collisions:
            nearer = " or comes nearer to something" if self.scenario.prefers_clearance else ""
            hindrance = f"collides{nearer}"
        elif self.scenario.prefers_clearance and cost.distance > least.distance:
            hindrance = "comes nearer to something"
        elif not cost.worse_than(least):
            same = self.search.near is None
            extra = cost.travel - least.travel if same else cost.distance - least.distance
        elif least.infeasible or least.violation:
            hindrance = "breaks limits by more"
        elif cost.impossible or cost.infeasible:
            hindrance = self._infeasible(other)
        elif cost.violation:
            hindrance = self._violation(other)
        else:
            hindrance = self._change(other)
        return Alternative(branch, self._turns(q), extra, hindrance)

    def _positions(self, other: AlternativeSequence) -> FloatArray:
        return positions_of(self.search.layers, other.index, self.search.rules)

    def _change(self, other: AlternativeSequence) -> str:
        """Find where a sequence changes its branch in an interval that avoids it."""
        flags = configuration_flags(self.robot, self._positions(other))
        changed = (flags[1:] * flags[:-1] < 0).any(axis=1) & self.search.rules.avoided
        if not changed.any():  # of branches that are singular, and pass for either
            return "changes the branch on the way"
        i = int(np.argmax(changed))
        return f"changes the branch from {self.names[i]!r} to {self.names[i + 1]!r}"

    def _violation(self, other: AlternativeSequence) -> str:
        """The joint that goes farthest beyond its limit in the middle of an interval."""
        search, q = self.search, self._positions(other)
        v = np.array(
            [
                np.zeros(q.shape[1]) if layer.velocity is None else layer.velocity[k]
                for layer, k in zip(search.layers, other.index, strict=True)
            ]
        )
        mean = np.diff(q, axis=0) / search.durations[:, None]
        middle = np.abs(1.5 * mean - 0.25 * (v[1:] + v[:-1]))
        i, j = divmod(int(np.argmax(middle / self.robot.velocity_limit)), len(v[0]))
        speed = self._speed(j, float(middle[i, j]))
        return f"{speed} halfway from {self.names[i]!r} to {self.names[i + 1]!r}"

    def _infeasible(self, other: AlternativeSequence) -> str:
        """Name the interval or waypoint of a sequence that is farthest beyond a velocity limit."""
        limit, worst, said = self.robot.velocity_limit, 1.0, "too fast"
        for i, candidates in enumerate(self.search.candidates):
            if candidates is None:
                continue
            row = self.search.rows[i][other.index[i]]
            if candidates.lost[row]:
                return f"singular at {self.names[i]!r}"
            use = np.abs(candidates.velocity[row]) / limit
            if use.max() > worst:
                j, worst = int(np.argmax(use)), float(use.max())
                said = f"{self._speed(j, worst * limit[j])} at {self.names[i]!r}"
        for i, j, move in self._too_fast(self._positions(other)):
            use_there = move / (limit[j] * self.search.durations[i])
            if use_there > worst:
                worst, speed = use_there, move / self.search.durations[i]
                said = f"{self._speed(j, speed)} from {self.names[i]!r} to {self.names[i + 1]!r}"
        return said

    def _speed(self, j: int, speed: float, needs: str = "", form: str = ".3g") -> str:
        units, unit = self.scenario.units, f"{self.robot.joint_units[j]}/s"
        limit = units.shown(float(self.robot.velocity_limit[j]), unit)[0]
        said = units.text(speed, unit, form)
        return f"{self.robot.joint_names[j]}{needs} {said} (limit {limit:{form}})"
