"""How far the tool is off the straight path, against closed forms."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from knotwork.verification.metrics.deviation import deviation_from_line
from sweeps import examples

RADIAN = 0.1  # what a radian counts where the tool moves and turns at once [m]


def pose(x: float, y: float, z: float, angle: float = 0.0) -> pin.SE3:
    return pin.SE3(pin.exp3(np.array([0.0, 0.0, angle])), np.array([x, y, z]))


distances = st.floats(-2, 2)


@examples(in_all=600)
@given(
    along=st.floats(0, 1),
    off=distances,
    length=st.floats(1e-4, 3),
    turn=st.floats(-2, 2),
    more=st.floats(-0.3, 0.3),
)
def test_off_the_line(along: float, off: float, length: float, turn: float, more: float) -> None:
    def path(s: float) -> pin.SE3:
        return pose(s * length, 0, 0, s * turn)

    reached = pose(along * length, off, 0, along * turn + more)
    found = deviation_from_line(reached, path(0.0), path(1.0))

    def errors(s: float) -> tuple[float, float]:
        return float(np.hypot((along - s) * length, off)), abs((along - s) * turn + more)

    grid = np.linspace(0, 1, 2001)
    least = min(d**2 + (RADIAN * a) ** 2 for d, a in map(errors, grid))
    assert found[0] ** 2 + (RADIAN * found[1]) ** 2 <= least + 1e-12
    assert found[0] >= abs(off) - 1e-12
    if more == 0.0:
        assert found == pytest.approx((abs(off), 0), abs=1e-7)


@pytest.mark.parametrize("apart", [0.0, 1e-16, 1e-12])
def test_deviation_at_one_place_is_turn_only(apart: float) -> None:
    start, end = pose(0.5, 0, 0), pose(0.5, apart, 0, 1.0)
    for turned in (0.0, 0.3, 1.0):
        off, angle = deviation_from_line(pose(0.5, 0, 0, turned), start, end)
        assert off < 1e-9
        assert angle < 1e-9
    assert deviation_from_line(pose(0.5, 0.02, 0, 0.4), start, end) == pytest.approx(
        (0.02, 0), abs=1e-9
    )
    assert deviation_from_line(pose(0.5, 0, 0, 1.25), start, end) == pytest.approx(
        (0, 0.25), abs=1e-9
    )
