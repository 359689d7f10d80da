from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import knotwork as kw
from knotwork.errors import PathError
from sweeps import examples

tp = kw.tool_paths


def wave(seed):
    rng = np.random.default_rng(seed)
    return tp.ThroughPoints(0.1 * np.cumsum(rng.normal((1.5, 0, 0), 0.6, (6, 3)), axis=0))


@examples(3, 18)
@given(st.integers(0, 10_000))
def test_tangent_is_constant_in_tool_axes(seed):
    curve = wave(seed)
    start = Rotation.random(random_state=seed).as_matrix()
    orientation = tp.tangent_orientation(curve, start)
    assert orientation.length == pytest.approx(curve.length, rel=1e-12)
    assert orientation.jumps.size == 0
    s = np.linspace(0, curve.length, 200)
    T = curve.position(s, 1)
    seen = np.einsum("kji,kj->ki", orientation.rotation(s), T)
    np.testing.assert_allclose(seen, np.tile(seen[0], (200, 1)), atol=2e-6)

    # Very many small turns, each about the axis at its middle.
    count = 20_000
    middle = (np.arange(count) + 0.5) * curve.length / count
    axes = np.cross(curve.position(middle, 1), curve.position(middle, 2))
    truth = start
    for turn in Rotation.from_rotvec(axes * curve.length / count).as_matrix():
        truth = turn @ truth
    np.testing.assert_allclose(orientation.rotations[-1], truth, atol=3e-6)


def test_refuses_invalid_rotation():
    with pytest.raises(PathError, match="not a rotation matrix"):
        tp.tangent_orientation(wave(1), 2 * np.eye(3))
