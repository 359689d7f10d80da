"""`PathSearch`: the greatest constant speeds of the stretches of one tool path.

The joints' motion along the path is made as it will be planned, and its exact peaks on each stretch
are compared with the limits, as are the speeds of joints that follow the path itself. The speeds of
all stretches are found by bisection at once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from knotwork.choosing.along_path import AlongPath, Hindrance
from knotwork.choosing.bracket import SLOWEST, STEP, Bracket
from knotwork.choosing.task import FreeTask
from knotwork.documents import REMOVED, Location
from knotwork.errors import DocumentError, InputError, PathError
from knotwork.scenario import ScenarioPath
from knotwork.timing import Binding
from knotwork.timing.budget import Watch
from knotwork.trajectory import JointTrajectory

Speeds = dict[int, float]
"""Speeds [m/s] by index of the stretch."""

DIGITS = 4
"""Speeds are rounded down to so many digits."""

FINE = 1.001
"""By this factor a stretch is tried faster where only its neighbours may have been too fast."""

NEARER = 8
"""So many times speeds without room are moved half the way to the last ones that had it."""

MOST = 60
"""Motions tried for one path."""

MOST_RELEASED = 16
"""Greater speeds tried for a stretch that had the speed of its neighbours."""

NEAR = 1.01
"""Of these, the greatest is sought up to this factor."""

ROUNDING = 1e-9
"""Durations that differ by no more than this part are the same."""

TOOL_ROOM = 1e-3
"""Along a path the tool stays below its limit by this part of it, so that it can be approached."""

TIMES = ("after", "time")
"""Keys of a waypoint that say when it is passed."""

RAMPS = Hindrance("", "room for changes of speed")

BUDGET = Hindrance("", "the end of the budget")


class PathSearch:
    """The search for the speeds of one path.

    Args:
        task: The task.
        path: One of its paths.
        most: Greatest speeds of the stretches whose speed is sought [m/s], by index.
        watch: What knows of the budget: when it has ended, the first speeds that do are taken.

    Attributes:
        caps: Greatest speeds of these, below the limit of the tool [m/s], by index.
        places: Indices in the file of their ends.
        asked: What is asked of the path, these speeds being chosen.
        first: The speeds that were tried first [m/s], by index.
        too_fast: What was exceeded where a speed failed last, by index.
        stuck: A stretch along which no speed will do, if that was found.
        no_room: Whether speeds failed because there was no room to change to them.
        stopped: Whether the budget ended the search.
    """

    def __init__(
        self,
        task: FreeTask,
        path: ScenarioPath,
        most: Mapping[int, float],
        watch: Watch | None = None,
    ) -> None:
        scenario, self.task, self.path = task.scenario, task, path
        self.along, self.unit = AlongPath(task, path), scenario.shown_length[0]
        self.limit = (1.0 - TOOL_ROOM) * (scenario.motion_limits.tool_speed or math.inf)
        self.caps = {k: min(speed, self.limit) for k, speed in sorted(most.items())}
        self.places = {k: task.free.index[path.first + 1 + k] for k in self.caps}
        self.asked = path.asked.choosing(self.caps)
        self.too_fast: dict[int, Hindrance] = {}
        self.stuck: int | None = None
        self.no_room, self.first = False, dict(self.caps)
        self.stopped, self._watch = False, watch or Watch()
        self._others = self._without_times()

    def _without_times(self) -> dict[Location, Any]:
        """The edits that take out the times of stretches whose speed is sought."""
        free = self.task.free
        edits: dict[Location, Any] = {}
        for place in self.places.values():
            waypoint = free.document.data["waypoints"][place]
            edits |= {("waypoints", place, key): REMOVED for key in TIMES if key in waypoint}
        if "times" in free.document.data and not free.duration.any():
            edits[("times",)] = REMOVED  # with these speeds every waypoint has its time
        return edits

    def accelerated(self, acceleration: float) -> PathSearch:
        """The same search where speeds change with another acceleration [m/s²]."""
        search = PathSearch(self.task, self.path, self.caps)
        search.asked = replace(search.asked, acceleration=acceleration)
        search._others |= acceleration_edit(self.task, acceleration)
        return search

    def edits(self, speeds: Speeds) -> dict[Location, Any]:
        """The edits for some speeds."""
        chosen: dict[Location, Any] = {
            ("waypoints", place, "speed"): rounded(self.unit * speeds[k])
            for k, place in self.places.items()
        }
        return self._others | chosen

    def binding(self, speeds: Speeds) -> list[Binding]:
        """What bounds each of the speeds that were found."""
        names = [waypoint.name for waypoint in self.task.scenario.waypoints]
        found = []
        for k, speed in speeds.items():
            held = self.too_fast.get(k, RAMPS)
            if not self.slowed(k, speeds):
                held = Hindrance("", "tool speed" if self.caps[k] == self.limit else "at_most")
            elif self.stopped:
                held = BUDGET
            elif self._with_room({**speeds, k: STEP * speed}, speeds).get(k, 0.0) <= speed:
                held = RAMPS
            i = self.path.first + k
            found.append(Binding(names[i], names[i + 1], *held, None))
        return found

    def greatest(self) -> Speeds | None:
        """The greatest speeds that keep all limits, as far as they are found.

        Raises:
            InputError: Nothing bounds a speed.
        """
        best = self._bisected(math.inf)
        level = self._level(best)
        if level is None:
            return best
        for k in level:
            level = self._released(level, k)
        return level

    def any(self) -> Speeds | None:
        """Some speeds that keep all limits.

        Raises:
            InputError: Nothing bounds a speed.
        """
        return self._bisected(1) or self._level(None)

    def _bisected(self, most: float) -> Speeds | None:
        """The greatest speeds that keep all limits, sought from likely ones, so many at most.

        A stretch at which a limit is exceeded is slowed down, whatever the others do, and becomes
        faster where none is. Its neighbours count as well, since speeds change from one to the
        other; so what is found has been tried as a whole.

        Raises:
            InputError: Nothing bounds a speed.
        """
        asked = self.likely()
        self.first = dict(asked)
        brackets = {k: Bracket() for k in asked}
        tried: set[tuple[float, ...]] = set()
        trial: Speeds = {}
        best: Speeds | None = None
        least = math.inf
        together: set[int] = set()  # those that failed last as others did
        while len(tried) < MOST and self.stuck is None and not self._late(best):
            trial = self._with_room(asked, trial)
            if not trial or tuple(trial.values()) in tried:
                break
            tried.add(tuple(trial.values()))
            failed = self._failed(trial)
            self.too_fast |= failed
            duration = self.asked.timed(trial)[0].duration
            if not failed and duration < least:
                best, least, most = trial, duration, most - 1
                if most == 0:
                    return best
            for k, speed in trial.items():
                if k in failed:
                    (together.add if len(failed) > 1 else together.discard)(k)
                    brackets[k].fails(speed, best[k] if best else 0.0)
                else:
                    brackets[k].does(speed)
            self.stuck = next((k for k in failed if trial[k] <= SLOWEST), None)
            for k, bracket in brackets.items():
                beside = [asked[j] for j in (k - 1, k + 1) if j in asked]
                asked[k] = bracket.following(beside, self._above)
        for k in together:
            if best is not None and not self._late(best) and math.isfinite(brackets[k].high):
                best = self._raised(best, k, brackets[k].high)
        return best

    def _level(self, best: Speeds | None) -> Speeds | None:
        """The best speeds, but none below some speed that all may have, if that takes less time.

        Where short stretches leave no room for changes of speed under a limit of jerk, they may
        need the very speed of their neighbours: one that is given, or the greatest of another.
        """
        beside = {j for k in self.caps for j in (k - 1, k + 1) if 0 <= j < len(self.asked.speeds)}
        given = {speed for j in beside if (speed := self.asked.speeds[j]) is not None}
        caps = {cap for cap in self.caps.values() if math.isfinite(cap)}
        for speed in sorted(given | caps, reverse=True):
            if self._late(best):
                break
            asked = dict.fromkeys(self.caps, speed)
            if best is not None:
                asked = {k: max(speed, best[k]) for k in asked}
            trial = self._with_room(asked, {})
            if trial and self._shorter(trial, best) and not self._failed(trial):
                return trial
        return None

    def _released(self, speeds: Speeds, k: int) -> Speeds:
        """The speeds with a greater one for a stretch, the others as they are, if that will do."""
        speed, high = self.first[k], math.inf
        for _ in range(MOST_RELEASED):
            if self._late(speeds):
                break
            trial = self._with_room({**speeds, k: speed}, speeds)
            if trial and self._shorter(trial, speeds) and not self._failed(trial):
                speeds = trial
            else:
                high = speed
            low = speeds[k]
            if high < NEAR * low or not math.isfinite(high):
                break
            speed = max(high / STEP, math.sqrt(low * high))
        return speeds

    def _late(self, found: Speeds | None) -> bool:
        """Whether to stop, because the budget has ended and speeds that do were found."""
        if found is not None and self._watch.late(found=True):
            self.stopped = True
        return found is not None and self.stopped

    def _shorter(self, speeds: Speeds, than: Speeds | None) -> bool:
        """Whether the path takes less time at some speeds than at others, if there are any."""
        if than is None:
            return True
        first, second = (self.asked.timed(one)[0].duration for one in (speeds, than))
        return first < (1.0 - ROUNDING) * second

    def _with_room(self, asked: Speeds, last: Speeds) -> Speeds:
        """Speeds as asked for; nearer to the last ones where given ones leave no room for these.

        There are none if not even the nearest have room.
        """
        for _ in range(NEARER):
            try:
                return self._fitted(asked)
            except PathError:
                self.no_room = True
                asked = {k: math.sqrt(speed * last.get(k, speed)) for k, speed in asked.items()}
        return {}

    def _raised(self, speeds: Speeds, k: int, speed: float) -> Speeds:
        """Speeds of which one is the greater, the others as they are, if that will do."""
        factor = FINE
        while (trial := self._with_room({**speeds, k: speed}, speeds)).get(k, 0.0) > speeds[k]:
            failed = self._failed(trial)
            self.too_fast |= failed
            if failed or self._late(speeds):
                break
            speeds, speed, factor = trial, speed * factor, factor * factor
        return speeds

    def _failed(self, speeds: Speeds) -> dict[int, Hindrance]:
        """Those of the stretches that are too fast, or whose neighbours are, and why."""
        try:
            hindrances = self.along.hindrances(self.task.with_edits(self.edits(speeds)))
        except (PathError, DocumentError):
            hindrances = dict.fromkeys(speeds, Hindrance("", "tolerances"))
        failed: dict[int, Hindrance] = {}
        for k, held in hindrances.items():
            before = [j for j in speeds if j < k][-1:]
            after = [j for j in speeds if j > k][:1]
            for j in [k] if k in speeds else before + after:
                failed.setdefault(j, held)
        return failed

    def slowed(self, k: int, speeds: Speeds) -> bool:
        """Whether a stretch is slower than it may be."""
        return speeds[k] < self._rounded(self.caps[k])

    def _fitted(self, speeds: Speeds) -> Speeds:
        """Rounded speeds that leave room for changes of speed, none above those."""
        bounded = {k: self._rounded(min(speed, self.caps[k])) for k, speed in speeds.items()}
        while True:
            fits = self.asked.fitted(bounded)
            if fits == bounded:
                return fits
            bounded = {k: self._rounded(speed) for k, speed in fits.items()}

    def _rounded(self, speed: float) -> float:
        """A speed as it is in the file."""
        if math.isinf(speed):
            return speed
        return rounded(self.unit * speed) / self.unit

    def _above(self, speed: float) -> float:
        """The next greater speed that can be in the file."""
        return rounded(self.unit * speed + 1.5 * _digit(self.unit * speed)) / self.unit

    def likely(self) -> Speeds:
        """Speeds from how far the motion at provisional ones is from the limits."""
        motion = self.along.motion(self.task.scenario)
        # at speeds at which the ends exceed a limit, they say nothing of the rest
        orders = 1 if self.along.joint_beyond(motion, 1.0) else 3
        likely = {}
        for k, cap in self.caps.items():
            likely[k] = min(self.path.stretches[k].speed * self._room(motion, k, orders), cap)
            if math.isinf(likely[k]):
                with self.task.scenario.error_context("waypoints", self.places[k], "speed"):
                    raise InputError(
                        "nothing bounds the speed along it; accepted: speed: {at_most: a speed}, "
                        "or limits"
                    )
        return likely

    def _room(self, motion: JointTrajectory, k: int, orders: int) -> float:
        """How many times faster a stretch could be, but for changes of speed and torques."""
        start, end = self.path.stretches[k].full_speed
        times = np.linspace(start, end, 200)
        factors = [math.inf]
        for order, quantity in enumerate(("velocity", "acceleration", "jerk")[:orders], 1):
            peak = np.abs(motion.polynomial(times, order)).max(axis=0)
            with np.errstate(divide="ignore"):
                limit = self.along.space.limits[quantity]
                factors.append(float((limit / peak).min()) ** (1.0 / order))
        return min(factors)


def acceleration_edit(task: FreeTask, acceleration: float) -> dict[Location, Any]:
    """The edit that has speeds along paths change with another acceleration [m/s²]."""
    value = task.scenario.shown_length[0] * acceleration
    if "path" in task.free.document.data:
        return {("path", "acceleration"): value}
    return {("path",): {"acceleration": value}}


def rounded(speed: float) -> float:
    """A speed rounded down to a few digits."""
    digit = _digit(speed)
    return float(f"{math.floor(speed / digit * (1.0 + 1e-12)) * digit:.{DIGITS}g}")


def _digit(speed: float) -> float:
    """What the last digit of a speed stands for."""
    return float(10.0 ** (math.floor(math.log10(speed)) - DIGITS + 1))
