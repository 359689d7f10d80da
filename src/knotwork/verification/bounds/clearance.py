"""Clearances of pairs of bodies, proved over all time by bounds on the motion of bodies.

Let d be the distance of two bodies at the middle of a time interval. Move the joints between them
from their positions at the middle to those at another time of the interval, one by one, from the
base outwards. Joint j turns its part by at most Δqⱼ, and moves every point of it by at most |Δqⱼ|
ρⱼ, where ρⱼ is the maximum distance of the body from axis j at the middle. This distance is valid
because outer joints have not moved yet, and inner joints move axis and body together. Thus the
distance is at least

    d − Σⱼ |Δqⱼ| ρⱼ

over the whole interval. Convex bodies are also separated by the plane normal to the line between
their nearest points at the middle, and only motion along this normal reduces their distance, to
first order (`relative_motion`). The better of the two bounds is used. If it does not decide, the
interval is divided into three, and the middle part keeps its distance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from knotwork.arrays import BoolArray, FloatArray, IndexArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.robot.joint_tree import place_joints
from knotwork.scene.bodies import Body
from knotwork.scene.collision_model import CollisionModel
from knotwork.scene.containment import is_one_inside_other
from knotwork.scene.distances import DISTANCE_ERROR, Nearest, find_nearest_points
from knotwork.scene.solid_pairs import SolidPairs
from knotwork.verification.bounds.contacts import contact_intervals
from knotwork.verification.bounds.rate_bounds import Intervals, first_intervals
from knotwork.verification.bounds.relative_motion import RelativeMotion

CLEARANCE_INTERVALS = 24
"""Approximate number of intervals of the first division, which is also at every break."""
DISTANCE_DECIMALS = 12
"""Decimals of lengths [m] that decide between times, so that every machine decides equally."""

CLEARANCE_PRECISION = 1e-3
"""Precision of a pair's minimum clearance [m], unless a fraction of the clearance is larger."""
RELATIVE_PRECISION = 0.05
"""Fraction of the clearance that is precise enough."""
INTERVAL_BLOCK = 2000
"""Number of intervals per block."""

DISTANCE_BUDGET = 100_000
"""Maximum number of distance measurements. Pairs that are undecided after them are unproved."""


class Clearance(NamedTuple):
    """Minimum clearance of two bodies over a motion.

    Attributes:
        first, second: The bodies.
        distance: Minimum distance found [m], negative for penetration.
        bound: Proved lower bound on the distance [m].
        required_clearance: Required clearance [m].
        involves_scene: Whether one of them is an object of the scene.
        time: Time of the minimum distance found [s].
        nearest: Nearest points at that time, in the axes of the URDF's root.
        state: `"clear"`, `"collides"` (the required clearance is not kept) or `"unproved"`.
        interval: Interval in which the required clearance is not kept or not proved [s], or `None`.
        contacts: Intervals in which it is not kept [s]; `interval` is the worst of them.
    """

    first: Body
    second: Body
    distance: float
    bound: float
    required_clearance: float
    involves_scene: bool
    time: float
    nearest: Nearest
    state: Literal["clear", "collides", "unproved"]
    interval: tuple[float, float] | None
    contacts: tuple[tuple[float, float], ...]

    @property
    def gap(self) -> float:
        """The distance minus the required clearance [m]."""
        return self.distance - self.required_clearance


def clearances(
    model: CollisionModel,
    curve: PiecewisePolynomial,
    resolution: float,
    precision: float | None = None,
) -> tuple[Clearance, ...]:
    """Prove the minimum clearance of each pair of bodies over a motion.

    Args:
        model: Bodies and pairs.
        curve: Joint positions, trailing shape (d,).
        resolution: Intervals in which bodies move less than this [m] are not divided further.
        precision: Precision of the minimum clearance of each pair [m]; by default 1 mm, or a
            fraction of the clearance if that is more.
    """
    if not model.pairs:
        return ()
    return _ClearanceSearch(model, curve, resolution, precision).result()


def least_clearance(
    model: CollisionModel, curve: PiecewisePolynomial, resolution: float, precision: float
) -> Clearance | None:
    """Find the minimum clearance of all pairs, relative to the required ones; `None` without pairs.

    Args:
        model: Bodies and pairs.
        curve: Joint positions, trailing shape (d,).
        resolution: See `clearances` [m].
        precision: Precision of the result [m].
    """
    rough = clearances(model, curve, resolution)
    if not rough:
        return None
    minimum = min(pair.gap for pair in rough)
    candidates = [pair for pair in rough if pair.bound - pair.required_clearance < minimum]
    near = {(pair.first, pair.second) for pair in candidates}
    pairs = [p for p in model.pairs if (model.bodies[p.first], model.bodies[p.second]) in near]
    exact = clearances(replace(model, pairs=tuple(pairs)), curve, resolution, precision)
    return min(exact or rough, key=lambda pair: pair.gap)


class _PairTests(NamedTuple):
    """m tests of a pair of solids, each over one interval.

    Attributes:
        interval: Indices of the intervals, shape (m,).
        solid_pair: Indices of the pairs of solids, shape (m,).
        distance: Distances of the solids at the middle [m], NaN until they are measured.
        normal: Unit vectors from the second to the first solid at the middle, shape (m, 3).
    """

    interval: IndexArray
    solid_pair: IndexArray
    distance: FloatArray
    normal: FloatArray


def _divide_in_three(
    intervals: Intervals, tests: _PairTests, is_undecided: BoolArray
) -> tuple[Intervals, _PairTests]:
    """Divide undecided intervals into three. Each middle part keeps the measured distance."""
    indices, row = np.unique(tests.interval[is_undecided], return_inverse=True)
    interval = (3 * row[:, None] + np.arange(3)).ravel()
    distance, normal = np.full((len(row), 3), np.nan), np.zeros((len(row), 3, 3))
    distance[:, 1], normal[:, 1] = tests.distance[is_undecided], tests.normal[is_undecided]
    solid_pair = np.repeat(tests.solid_pair[is_undecided], 3)
    return intervals[indices].split(3), _PairTests(
        interval, solid_pair, distance.ravel(), normal.reshape(-1, 3)
    )


class _ClearanceSearch:
    """Adaptive division of a motion's time, for all pairs of solids together.

    Attributes:
        distance, time: Minimum distance found so far [m], and its time [s].
        goal: Lower bound of the distance that decides an interval [m].
        bound: Minimum of the bounds in decided intervals [m].
        unproved_from, unproved_until: Times between which clearance is not proved [s].
    """

    def __init__(
        self,
        model: CollisionModel,
        curve: PiecewisePolynomial,
        resolution: float,
        precision: float | None,
    ) -> None:
        self.model, self.resolution = model, resolution
        self.curve = curve = model.all_positions(curve)
        self.table = SolidPairs(model)
        self.body_pair = self.table.body_pair
        self.presence = model.presence_within(*curve.x[[0, -1]].tolist())
        self.precision = CLEARANCE_PRECISION if precision is None else precision
        self.relative_precision = RELATIVE_PRECISION if precision is None else 0.0
        self.distance = np.full(len(self.body_pair), np.inf)
        self.time = np.full(len(self.body_pair), curve.x[0])
        self.goal = np.full(len(self.body_pair), np.inf)
        self.bound = np.full(len(self.body_pair), np.inf)
        self.measurements = 0
        self.unproved_from = np.full(len(self.body_pair), np.inf)
        self.unproved_until = np.full(len(self.body_pair), -np.inf)

    def result(self) -> tuple[Clearance, ...]:
        first = first_intervals(self.curve.x, CLEARANCE_INTERVALS, self.presence)
        for low in range(0, len(first.piece), INTERVAL_BLOCK):
            intervals = first[low : low + INTERVAL_BLOCK]
            tests = self._first_tests(intervals)
            while len(tests.interval):
                intervals, tests = self._refine(intervals, tests)
        self._find_enclosed()
        return tuple(self._clearances())

    def _first_tests(self, intervals: Intervals) -> _PairTests:
        """Tests of the pairs of solids that exist together in each interval."""
        middle = self.curve.x[intervals.piece] + intervals.middle
        presence = self.presence[self.body_pair]
        exist = (middle[:, None] > presence[:, 0]) & (middle[:, None] < presence[:, 1])
        interval, solid_pair = np.nonzero(exist)
        unmeasured = np.full(len(solid_pair), np.nan)
        return _PairTests(interval, solid_pair, unmeasured, np.zeros((len(solid_pair), 3)))

    def _refine(self, intervals: Intervals, tests: _PairTests) -> tuple[Intervals, _PairTests]:
        """Measure where needed, decide intervals, and divide the undecided ones into three."""
        motions = RelativeMotion(self.table, self.curve, intervals)
        time = self.curve.x[intervals.piece] + intervals.middle
        tested = tests.interval, tests.solid_pair
        distance_bound = self.table.min_distances(*tested, *motions.placed)
        motion = motions.largest(*tested)
        self._measure(tests, time, motions.placed, distance_bound - motion, motion)
        is_measured = ~np.isnan(tests.distance)
        distance_bound[is_measured] = tests.distance[is_measured] - DISTANCE_ERROR
        goal = self.goal[tests.solid_pair]
        lower = self._bounds_by_planes(tests, motions, distance_bound - motion, goal)
        is_decided = (lower >= goal) | (motion <= self.resolution)
        is_decided |= self.measurements >= DISTANCE_BUDGET
        np.minimum.at(self.bound, tests.solid_pair[is_decided], lower[is_decided])
        required = self.table.required_clearance[tests.solid_pair]
        is_unproved = is_decided & (lower < required) & (self.distance[tests.solid_pair] > required)
        interval, solid_pair = tests.interval[is_unproved], tests.solid_pair[is_unproved]
        half = intervals.duration[interval] / 2
        np.minimum.at(self.unproved_from, solid_pair, time[interval] - half)
        np.maximum.at(self.unproved_until, solid_pair, time[interval] + half)
        return _divide_in_three(intervals, tests, ~is_decided)

    def _bounds_by_planes(
        self,
        tests: _PairTests,
        motions: RelativeMotion,
        lower: FloatArray,
        goal: FloatArray,
    ) -> FloatArray:
        """Improve bounds by planes that separate convex solids, where they are below their goals.

        Args:
            tests: Pairs of solids over intervals, measured.
            motions: Their relative motion.
            lower: Lower bound of each distance over the interval [m], shape (m,).
            goal: Bound that decides an interval [m], shape (m,).

        Returns:
            The better of both bounds [m], shape (m,).
        """
        is_separable = self.table.convex[tests.solid_pair] & (tests.distance > 0.0) & (lower < goal)
        rows = np.flatnonzero(is_separable)
        solid_pair = tests.solid_pair[rows]
        normal = self.table.separating_normals(solid_pair, tests.normal[rows])
        tested = tests.interval[rows], solid_pair, normal
        distance = self.table.distances_along(*tested, *motions.placed) - DISTANCE_ERROR
        by_planes = np.full_like(lower, -np.inf)
        by_planes[rows] = distance - motions.approach(*tested)
        return np.maximum(lower, by_planes)

    def _measure(
        self,
        tests: _PairTests,
        time: FloatArray,
        placed: tuple[FloatArray, FloatArray],
        lower: FloatArray,
        motion: FloatArray,
    ) -> None:
        """Measure distances in order of their bounds, as long as they may change the minimum.

        The search for the distance of an exact mesh ends as soon as the distance is large enough to
        decide its interval, and not below the minimum found.

        Args:
            tests: Pairs of solids over intervals; distances and normals are filled in.
            time: Middle of each interval [s].
            placed: Rotations and origins of the solids at these times, see `SolidPairs.placements`.
            lower: Lower bound from boxes over each interval [m].
            motion: Upper bound on the relative motion of the two solids [m].
        """
        waiting = np.flatnonzero(np.isnan(tests.distance) & (lower < self.goal[tests.solid_pair]))
        waiting = waiting[np.argsort(np.round(lower[waiting], DISTANCE_DECIMALS), kind="stable")]
        goal, smallest = self.goal.tolist(), self.distance.tolist()  # faster than arrays
        columns = (tests.solid_pair, tests.interval, lower, motion)
        listed = (column[waiting].tolist() for column in columns)
        for test, c, interval, bound, moved in zip(waiting.tolist(), *listed, strict=True):
            if bound >= goal[c]:
                continue
            enough = max(goal[c] + moved + 2 * DISTANCE_ERROR, smallest[c])
            d, normal = self.table.measure(c, placed[0][interval], placed[1][interval], enough)
            tests.distance[test], tests.normal[test] = d, normal
            self.measurements += 1
            if d < smallest[c] - 10.0**-DISTANCE_DECIMALS:
                smallest[c] = self.distance[c] = d
                self.time[c] = time[interval]
                required = float(self.table.required_clearance[c])
                wanted = d - max(self.precision, self.relative_precision * abs(d))
                goal[c] = self.goal[c] = max(wanted, required) if d > required else wanted

    def _find_enclosed(self) -> None:
        """Find solids inside meshes. If the surfaces never touch, one test decides for all time."""
        for c in np.flatnonzero((self.distance > 0.0) & self.table.exact).tolist():
            start = float(self.presence[self.body_pair[c]][0])
            turn, shift = (x[0] for x in self.table.placements(*self._place([start])))
            if is_one_inside_other(*self.table.placed_pair(c, turn, shift)):
                self.distance[c], self.time[c] = -self.distance[c], start
                self.bound[c] = -np.inf

    def _place(self, times: Sequence[float]) -> tuple[FloatArray, FloatArray]:
        """Rotations and origins of all joints at some times."""
        return place_joints(self.model.tree, self.curve(np.array(times)))

    def _clearances(self) -> Iterator[Clearance]:
        """The clearance of each pair of bodies that exist together."""
        solids = [np.flatnonzero(self.body_pair == k) for k in range(len(self.model.pairs))]
        worst = [int(of_pair[self.distance[of_pair].argmin()]) for of_pair in solids]
        rotation, origin = self._place(self.time[worst].tolist())
        for k, (pair, of_pair) in enumerate(zip(self.model.pairs, solids, strict=True)):
            distance, time = float(self.distance[worst[k]]), float(self.time[worst[k]])
            if np.isinf(distance):
                continue  # they never exist together
            first, second = self.model.bodies[pair.first], self.model.bodies[pair.second]
            nearest = find_nearest_points(first, second, rotation[k], origin[k])
            if nearest.distance < distance - 10.0**-DISTANCE_DECIMALS:
                distance = nearest.distance  # for solids that were not measured at that time
            state: Literal["clear", "collides", "unproved"] = "clear"
            interval = None
            contacts: tuple[tuple[float, float], ...] = ()
            low, high = self.unproved_from[of_pair].min(), self.unproved_until[of_pair].max()
            if distance <= pair.required_clearance:
                start, end = self.presence[k].tolist()
                state = "collides"
                contacts = contact_intervals(self.model, self.curve, k, start, end, time)
                interval = next(span for span in contacts if span[0] <= time <= span[1])
            elif low <= high:
                state, interval = "unproved", (float(low), float(high))
            yield Clearance(
                first,
                second,
                distance,
                bound=float(self.bound[of_pair].min()),
                required_clearance=pair.required_clearance,
                involves_scene=pair.involves_scene,
                time=time,
                nearest=nearest,
                state=state,
                interval=interval,
                contacts=contacts,
            )
