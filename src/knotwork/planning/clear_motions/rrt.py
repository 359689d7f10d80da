"""Polylines between configurations, collision-free at samples: RRT-Connect and shortcuts.

RRT-Connect: Kuffner and LaValle, ICRA 2000. Trees are balanced, and each has a root for each
solution of its end.
"""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.planning.clear_motions.configuration_space import ConfigurationSpace

EXTENSION_LENGTH = 1.0
"""Length of an extension of a tree [rad or m]."""

SAMPLING_RANGE = np.pi
"""Maximum distance of sampled joint positions beyond the ends [rad or m]."""

MAX_DIRECT_EDGES = 24
"""Number of straight edges between ends that are tested, the shortest first."""

MAX_SHORTCUTS = 150
MAX_FAILURES = 40
"""Maximum numbers of candidate shortcuts, and of consecutive failures."""


class _Tree:
    """A tree of configurations. Each has the index of its parent, or -1 for a root.

    Args:
        space: Collision tests.
        roots: Its roots [rad or m], shape (m, d).
        step: Step of samples on edges [rad or m].
    """

    def __init__(self, space: ConfigurationSpace, roots: FloatArray, step: float) -> None:
        self.space, self.step = space, step
        self.parent: list[int] = []
        self._q = np.empty((256, roots.shape[1]))
        for root in roots:
            self.add(root, -1)

    def __getitem__(self, i: int) -> FloatArray:
        return np.asarray(self._q[i])

    def add(self, q: FloatArray, parent: int) -> int:
        if len(self.parent) == len(self._q):
            self._q = np.concatenate((self._q, np.empty_like(self._q)))
        self._q[len(self.parent)] = q
        self.parent.append(parent)
        return len(self.parent) - 1

    def nearest(self, q: FloatArray) -> int:
        offset = self._q[: len(self.parent)] - q
        return int(np.argmin(np.einsum("ij,ij->i", offset, offset)))

    def branch(self, i: int) -> list[FloatArray]:
        """Configurations from one to its root."""
        nodes = []
        while i >= 0:
            nodes.append(self[i].copy())
            i = self.parent[i]
        return nodes

    def extend(self, target: FloatArray, parent: int | None = None) -> int | None:
        """Add a configuration towards a target, from the nearest one or a given one."""
        near = self.nearest(target) if parent is None else parent
        move = target - self[near]
        length = float(np.linalg.norm(move))
        q = (
            target
            if length <= EXTENSION_LENGTH
            else self[near] + move * (EXTENSION_LENGTH / length)
        )
        if self.space.is_clear(q) and self.space.is_clear_edge(self[near], q, self.step):
            return self.add(q, near)
        return None

    def connect(self, target: FloatArray) -> tuple[int, bool]:
        """Extend the tree towards a target until a collision.

        Returns:
            The last node, and whether it is the target.
        """
        node: int | None = self.nearest(target)
        while node is not None:
            last = node
            if np.array_equal(self[last], target):
                return last, True
            node = self.extend(target, last)
        return last, False


def connect(
    space: ConfigurationSpace,
    starts: FloatArray,
    goals: FloatArray,
    rng: np.random.Generator,
    step: float,
    max_checks: int,
) -> FloatArray | None:
    """Find a polyline from one of several configurations to one of others.

    Args:
        space: Collision tests.
        starts: Possible starts [rad or m], shape (m, d).
        goals: Possible ends, shape (k, d).
        rng: Random number generator.
        step: Step of samples on edges [rad or m].
        max_checks: Approximate maximum number of configurations checked.

    Returns:
        Corners of the polyline, shape (n, d), or `None`.
    """
    length = np.linalg.norm(starts[:, None] - goals, axis=2)
    for k in length.argsort(axis=None, kind="stable")[:MAX_DIRECT_EDGES]:
        i, j = divmod(int(k), len(goals))
        if space.is_clear_edge(starts[i], goals[j], step):
            return np.stack((starts[i], goals[j]))
    ends = np.concatenate((starts, goals))
    lower = np.maximum(space.lower, ends.min(axis=0) - SAMPLING_RANGE)
    upper = np.minimum(space.upper, ends.max(axis=0) + SAMPLING_RANGE)
    tree, other_tree = _Tree(space, starts, step), _Tree(space, goals, step)
    swapped, end = False, space.checks + max_checks
    while space.checks < end:
        reached = tree.extend(rng.uniform(lower, upper))
        if reached is not None:
            target = tree[reached]
            node, met = other_tree.connect(target)
            if met:
                line = tree.branch(reached)[::-1] + other_tree.branch(node)[1:]
                return np.array(line[::-1] if swapped else line)
        if len(tree.parent) > len(other_tree.parent):
            tree, other_tree, swapped = other_tree, tree, not swapped
    return None


def shorten_polyline(
    space: ConfigurationSpace,
    line: FloatArray,
    rng: np.random.Generator,
    step: float,
    weights: FloatArray,
) -> FloatArray:
    """Shorten a polyline by collision-free straight edges between random points of it.

    Args:
        space: Collision tests.
        line: Corners of the polyline [rad or m], shape (n, d).
        rng: Random number generator.
        step: Step of samples on edges [rad or m].
        weights: Weights of the joints in lengths, shape (d,).
    """
    points, failed = list(line), 0
    for _ in range(MAX_SHORTCUTS):
        if len(points) < 3 or failed > MAX_FAILURES:
            break
        edges = np.linalg.norm(np.diff(points, axis=0) * weights, axis=1)
        along = np.concatenate(([0.0], np.cumsum(edges)))
        cuts = np.sort(rng.uniform(0.0, along[-1], 2))
        i, j = np.clip(np.searchsorted(along, cuts, side="right") - 1, 0, len(edges) - 1).tolist()
        if i == j:
            continue
        start, end = (
            points[k] + (s - along[k]) / edges[k] * (points[k + 1] - points[k])
            for k, s in zip((i, j), cuts.tolist(), strict=True)
        )
        shorter = np.linalg.norm((end - start) * weights) < 0.999 * (cuts[1] - cuts[0])
        if shorter and space.is_clear_edge(start, end, step):
            points[i + 1 : j + 1] = [start, end]
            failed = 0
        else:
            failed += 1
    return np.array(_remove_corners(space, points, step))


def _remove_corners(
    space: ConfigurationSpace, points: list[FloatArray], step: float
) -> list[FloatArray]:
    """Remove corners while the straight edges past them are collision-free."""
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9
    points = [points[0], *(q for q, far in zip(points[1:], moved, strict=True) if far)]
    k = 1
    while k < len(points) - 1:
        if space.is_clear_edge(points[k - 1], points[k + 1], step):
            del points[k]
            k = max(k - 1, 1)
        else:
            k += 1
    return points


def polyline_curve(line: FloatArray) -> PiecewisePolynomial:
    """A polyline over its length [rad or m]; corners of shape (n, d)."""
    length = np.linalg.norm(np.diff(line, axis=0), axis=1)
    slope = np.diff(line, axis=0) / length[:, None]
    zero = np.zeros_like(slope)
    along = np.concatenate(([0.0], np.cumsum(length)))
    return PiecewisePolynomial(np.stack((zero, zero, slope, line[:-1])), along)
