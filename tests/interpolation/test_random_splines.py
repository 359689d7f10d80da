"""Thousands of random splines: what the spline promises, for every option and uneven times.

Each grid of waypoints carries four joints whose positions and velocities are of independent sizes
from 1e-3 to 1e3: 860 grids with three knot rules are 10,320 cases, of which `make test` tries a
tenth. No other C² cubic on the same knots has these positions, velocities and end accelerations.
"""

from __future__ import annotations

import numpy as np
import pytest

from knotwork.curves.interpolation import BalancedKnots, ModifiedHermiteSpline
from sweeps import first_of

GRIDS = 860  # in all, over four seeds
JOINTS = 4
EPS = np.finfo(float).eps


def random_grid(rng):
    """Times with interval ratios up to 1000:1, anywhere; positions and velocities of any size."""
    n = int(rng.integers(2, 51))
    ratio = 10 ** rng.uniform(0, 3)
    h = 10 ** rng.uniform(-2, 1) * ratio ** rng.uniform(0, 1, n - 1)
    x = rng.choice([0.0, 100.0]) * rng.uniform() + np.concatenate(([0.0], np.cumsum(h)))
    y, v = (10 ** rng.uniform(-3, 3, JOINTS) * rng.normal(size=(n, JOINTS)) for _ in range(2))
    return x, y, v


def random_knots(rng, x, doubled_ends):
    h = np.diff(x)
    low, high = np.sort(rng.uniform(0.05, 0.95, (2, h.size)), axis=0)
    high = np.maximum(high, low + 0.02)
    inner = np.stack((x[:-1] + low * h, x[:-1] + high * h), axis=1).ravel()
    if not doubled_ends:
        inner = inner[1:-1]
    return np.concatenate((x[:1], inner, x[-1:]))


def largest(values):
    return np.abs(values).max(axis=0)


def cases(seed, grids):
    rng = np.random.default_rng(seed)
    for _ in range(grids):
        x, y, v = random_grid(rng)
        for rule in ("paper", "balanced", "by hand"):
            ends = [None, "zero", rng.normal(size=(2, JOINTS))][int(rng.integers(3))]
            knots = rule
            if rule == "by hand":
                knots = random_knots(rng, x, ends is not None)
            elif rule == "balanced":
                knots = BalancedKnots(rng.choice([0.05, 0.2, 0.45]))
            yield x, y, v, knots, ends


@pytest.mark.parametrize("grids", first_of(GRIDS // 40, GRIDS // 4))
@pytest.mark.parametrize("seed", range(4))
def test_ten_thousand_random_cases(seed, grids):
    for x, y, v, knots, ends in cases(seed, grids):
        spline = ModifiedHermiteSpline(x, y, v, knots=knots, end_acceleration=ends)
        h = np.diff(x)[:, None]
        assert len(spline.x) == (2 * len(x) if ends is not None else 2 * len(x) - 2)
        assert (np.diff(spline.x) > 0).all()

        position_scale = np.maximum(largest(y), largest(np.maximum(abs(v[1:]), abs(v[:-1])) * h))
        velocity_scale = np.maximum(largest(v), largest(np.diff(y, axis=0) / h))
        # beside a much shorter neighbour a curve on arbitrary knots can swing out to more than
        # 1e5 times its data; no polynomial with such values holds the data to better than this
        swing = largest(spline(spline.x)), largest(spline(spline.x, 1))
        bound = np.maximum(1e-10 * position_scale, 8 * EPS * swing[0])
        assert (largest(spline(x) - y) <= bound).all()
        bound = np.maximum(1e-9 * velocity_scale, 8 * EPS * swing[1])
        assert (largest(spline(x, 1) - v) <= bound).all()
        if not isinstance(knots, np.ndarray):
            assert (largest(spline(x) - y) <= 1e-10 * position_scale).all()
            assert (largest(spline(x, 1) - v) <= 1e-9 * velocity_scale).all()

        if len(spline.x) > 2:
            for nu, tolerance in ((0, 1e-11), (1, 1e-12), (2, 1e-13)):
                jumps = largest(spline.jumps(nu))
                assert (jumps <= tolerance * largest(spline(spline.x, nu))).all()
        asked = None if ends is None else np.zeros((2, JOINTS)) if isinstance(ends, str) else ends
        if asked is not None:
            reached = spline(x[[0, -1]], 2)
            peak = largest(spline(spline.x, 2))
            assert (largest(reached - asked) <= 1e-13 * peak).all()
