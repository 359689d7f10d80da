from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

import knotwork as kw
from knotwork.errors import PathError
from sweeps import examples

tp = kw.tool_paths

seeds = st.integers(0, 100_000)
AWAY = np.array([0.1, 0.2, 0])


def random_points(seed):
    rng = np.random.default_rng(seed)
    return 0.1 * np.cumsum(rng.normal((1.5, 0, 0), size=(int(rng.integers(2, 9)), 3)), axis=0)


def curves(seed):
    rng = np.random.default_rng(seed)
    yield tp.ThroughPoints(random_points(seed))
    after = 0.1 * rng.normal(size=3) + AWAY
    room = 0.9 * min(0.1, float(np.linalg.norm(after - [0.1, 0, 0])))
    yield tp.Blend([0, 0, 0], [0.1, 0, 0], after, min(0.03, room))


@examples()
@given(seeds)
def test_positions_by_arc_length(seed):
    h = 2e-5
    for curve in curves(seed):
        margin = np.array([-0.001, *np.linspace(0, curve.length, 25), curve.length + 0.001])
        speed = np.linalg.norm(curve.position(margin, 1), axis=1)
        np.testing.assert_allclose(speed, 1.0, atol=1e-12)
        ends = getattr(curve, "arc_lengths", np.array([0.0, curve.length]))
        # away from points, where the third derivative jumps
        s = margin[(np.abs(margin[:, None] - ends) > 2 * h).all(axis=1)]
        for order in (1, 2, 3):
            by_differences = (
                8 * (curve.position(s + h, order - 1) - curve.position(s - h, order - 1))
                - (curve.position(s + 2 * h, order - 1) - curve.position(s - 2 * h, order - 1))
            ) / (12 * h)
            exact = curve.position(s, order)
            size = np.abs(curve.position(margin, 2)).max() ** order + 1.0
            np.testing.assert_allclose(by_differences, exact, atol=1e-5 * size)


@examples()
@given(seeds)
def test_through_points_is_scipy_spline(seed):
    points = random_points(seed)
    curve = tp.ThroughPoints(points)
    np.testing.assert_allclose(curve.position(curve.arc_lengths), points, atol=1e-13)
    x = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    spline = CubicSpline(x, points)
    ends = [0.0]
    for a, b in pairwise(x):
        length = quad(
            lambda u: np.linalg.norm(spline(u, 1)), a, b, epsabs=1e-14, epsrel=1e-13, limit=400
        )
        ends.append(ends[-1] + length[0])
    np.testing.assert_allclose(curve.arc_lengths, ends, rtol=1e-12)
    assert curve.length == curve.arc_lengths[-1]
    # A point of the spline is that of the curve at the same arc length.
    u = 0.3 * x[0] + 0.7 * x[1]
    s = quad(lambda u: np.linalg.norm(spline(u, 1)), 0, u, epsabs=1e-14, epsrel=1e-13)[0]
    np.testing.assert_allclose(curve.position([s])[0], spline(u), atol=1e-12)


@examples()
@given(seeds)
def test_nearest_points(seed):
    for curve in curves(seed):
        rng = np.random.default_rng(seed)
        s = rng.uniform(0, curve.length, 8)
        radius = 1 / max(curve.curvature_bound([0.0], [curve.length])[0], 1e-3)
        aside = rng.normal(size=(8, 3))
        aside *= min(0.3 * radius, 0.05) / np.linalg.norm(aside, axis=1)[:, None]
        points = curve.position(s) + aside
        guess = np.clip(s + rng.uniform(-0.3, 0.3, 8) * min(radius, 0.1), 0, curve.length)
        found = curve.nearest(points, guess)
        off = np.linalg.norm(curve.position(found) - points, axis=1)
        for i in range(8):
            limits = np.clip(s[i] + np.array([-0.5, 0.5]) * min(radius, 0.1), 0, curve.length)
            best = minimize_scalar(
                lambda s, to=points[i], of=curve.position: np.linalg.norm(of([s])[0] - to),
                bounds=limits,
                method="bounded",
                options={"xatol": 1e-10},
            )
            assert off[i] <= best.fun + 1e-9


@examples()
@given(seeds)
def test_curvature_bound_holds(seed):
    for curve in curves(seed):
        s0, s1 = np.random.default_rng(seed).uniform(0, curve.length, (2, 25))
        bound = curve.curvature_bound(s0, s1)
        whole = curve.curvature_bound([0.0], [curve.length])[0]
        for i in range(25):
            s = np.linspace(s0[i], s1[i], 100)
            curvature = np.linalg.norm(curve.position(s, 2), axis=1).max()
            assert curvature <= bound[i] * (1 + 1e-9) <= whole * (1 + 1e-8)


@pytest.mark.parametrize(
    ("degrees", "most"),
    [(0, 1), (1, 1.4), (30, 1.4), (60, 1.4), (90, 1.4), (120, 1.4), (150, 1.4), (165, 2), (179, 5)],
)
def test_blend_has_continuous_curvature(degrees, most):
    theta, d = math.radians(degrees), 0.02
    after = [0.1 + 0.1 * math.cos(theta), 0.1 * math.sin(theta), 0]
    blend = tp.Blend([0, 0, 0], [0.1, 0, 0], after, d)
    first, last = tp.Line([0, 0, 0], blend.start), tp.Line(blend.end, after)
    path = tp.ToolPath(
        [first, blend, last],
        tp.OrientationCurve.constant(np.eye(3), first.length + blend.length + last.length),
    )
    assert first.length == pytest.approx(0.08)
    assert last.length == pytest.approx(0.08)
    ends = path.starts[1:]
    for side in (-0.01, 0.01):
        bend = path.derivatives(ends, 2, at=ends + side)[2]
        np.testing.assert_allclose(bend, np.zeros((2, 3)), atol=1e-9)
    assert blend.angle == pytest.approx(theta, abs=1e-12)
    s = np.linspace(0, blend.length, 2001)
    peak = np.linalg.norm(blend.position(s, 2), axis=1).max()
    arc = math.tan(0.5 * theta) / d  # curvature of the arc between the same ends
    assert peak <= most * arc + 1e-9
    off = np.linalg.norm(blend.position(s) - [0.1, 0, 0], axis=1)
    assert off.max() <= d + 1e-12
    assert off.min() == pytest.approx(blend.deviation, abs=1e-12)


REFUSED = [
    (lambda: tp.ThroughPoints([[0, 0, 0]]), "1 points are given"),
    (lambda: tp.ThroughPoints([[0, 0, 0], [1, 0, 0], [1, 0, 0]]), "the same, .1, 0, 0. m"),
    (lambda: tp.ThroughPoints([[0, 0, 0], [1, 0, 0], [0.5, 0, 0]]), "between .0, 0, 0. m and .1"),
    (lambda: tp.Blend([0, 0, 0], [1, 0, 0], [1, 1, 0], 0.0), "blend distance is 0"),
    (lambda: tp.Blend([0, 0, 0], [1, 0, 0], [1, 0.1, 0], 0.2), r"the line after .* is 0\.1 m long"),
    (lambda: tp.Blend([0, 0, 0], [1, 0, 0], [0.5, 0, 0], 0.2), "turns back"),
    (lambda: tp.Blend([1, 0, 0], [1, 0, 0], [1, 1, 0], 0.2), "the line before .* is 0 m long"),
]


@pytest.mark.parametrize(("make", "message"), REFUSED)
def test_refuses_invalid_curves(make, message):
    with pytest.raises(PathError, match=message):
        make()


def test_reads_points_of_file(tmp_path):
    file = tmp_path / "seam.csv"
    file.write_text(
        "# from CAD\nz, x, y, qw, qx, qy, qz\n0,0,0,1,0,0,0\n\n5,100,0,-0.9999,0,0,0\n"
        "5,200,50,0.7071,0,0.7071,0\n",
        encoding="utf-8",
    )
    points, rotations, normals = tp.read_points(file, 0.001)
    np.testing.assert_allclose(points, [[0, 0, 0], [0.1, 0, 0.005], [0.2, 0.05, 0.005]])
    quarter_turn = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    np.testing.assert_allclose(rotations, [np.eye(3), np.eye(3), quarter_turn], atol=1e-15)
    assert normals is None
    file.write_text("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n1,0,0,0,0,0.9999\n", encoding="utf-8")
    _, rotations, normals = tp.read_points(file, 1.0)
    assert rotations is None
    np.testing.assert_array_equal(normals, [[0, 0, 1], [0, 0, 1]])
