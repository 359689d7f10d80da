"""Saying which solutions were chosen and why, and what no choice can do."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from knotwork.kinematics.geometry.configuration_flags import configuration_flags, describe_flags
from knotwork.kinematics.sequence.candidates import Candidates
from knotwork.kinematics.sequence.step_costs import AT_LIMIT
from knotwork.task_to_joint.search import Found, Search
from knotwork.task_to_joint.solution import Choice, Infeasibility
from knotwork.waypoints import FloatArray


class Explanation:
    """Reasons for a choice of solutions.

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
            if candidates is not None and i not in self.search.free_velocity:
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
            f"{self._others}; {longest:.4g} s or more is sufficient for the mean, and they have "
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
        limit, times = self.robot.velocity_limit, self.scenario.provisional_times
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

    def _speed(self, j: int, speed: float, needs: str = "", form: str = ".3g") -> str:
        units, unit = self.scenario.units, f"{self.robot.joint_units[j]}/s"
        limit = units.shown(float(self.robot.velocity_limit[j]), unit)[0]
        number = units.text(speed, unit, form)
        return f"{self.robot.joint_names[j]}{needs} {number} (limit {limit:{form}})"
