"""Where a scene is looked at from first, and what hides what."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from knotwork.view.camera import first_view, hidden

WALL = np.array([[[0, -1, -1], [0, 1, -1], [0, 0, 2]]], dtype=float)  # in the plane x = 0


def test_what_lies_behind_a_wall_is_hidden() -> None:
    points = np.array([[-1, 0, 0], [1, 0, 0], [-1, 3, 0], [-1, 0, 3]], dtype=float)
    towards = np.array([1.0, 0, 0])
    assert hidden(points, WALL, towards).tolist() == [True, False, False, False]
    assert hidden(points, WALL, -towards).tolist() == [False, True, False, False]
    # along the wall nothing is behind it
    assert not hidden(points, WALL, np.array([0, 1.0, 0])).any()


@given(st.integers(0, 10_000))
def test_hidden_is_what_a_ray_towards_the_camera_meets(seed: int) -> None:
    """Each ray is followed by solving for where it meets each triangle's plane."""
    random = np.random.default_rng(seed)
    points, triangles = random.normal(size=(6, 3)), random.normal(size=(5, 3, 3))
    towards = random.normal(size=3)
    towards /= np.linalg.norm(towards)
    expected = []
    for point in points:
        met = []
        for a, b, c in triangles:
            u, v, distance = np.linalg.solve(np.stack([b - a, c - a, -towards], 1), point - a)
            met.append(u >= 0 and v >= 0 and u + v <= 1 and distance > 0)
        expected.append(any(met))
    assert hidden(points, triangles, towards).tolist() == expected


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_path_is_seen_from_the_side_that_does_not_hide_it(side: float) -> None:
    path = np.linspace([1.0, -0.3, 0.3], [1.0, 0.3, 0.3], 30)
    # a board as tall as an arm on one side of the path
    y = side * 0.5
    board = np.array(
        [[[0, y, 0], [2, y, 0], [2, y, 2]], [[0, y, 0], [2, y, 2], [0, y, 2]]], dtype=float
    )
    points = np.concatenate([board.reshape(-1, 3), path, np.zeros((1, 3))])
    view = first_view(points, path, [board, board])
    towards = np.array(view["from"])
    assert np.linalg.norm(towards) == pytest.approx(1.0)
    assert 0.3 < towards[2] < 0.7  # from above, upright
    assert not hidden(path, board, towards).any()
    # the mirrored task is seen from the mirrored side or from one that does as well
    assert view == first_view(points, path, [board, board])


def test_a_flat_arm_is_seen_from_above_and_a_still_tool_from_somewhere() -> None:
    flat = np.array([[0, 0, 0], [1, 0, 0.01], [0, 1, 0.02]], dtype=float)
    assert first_view(flat, np.zeros((0, 3)))["from"][2] > 0.7
    assert np.isfinite(first_view(flat, np.ones((5, 3)), [WALL])["from"]).all()
