"""How many points define a motion, and how exact they are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motions import hermite_data, motion

from knotwork.curves.interpolation import PLANNERS
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import ExportError, InputError
from knotwork.files.export import motion_points
from sweeps import examples

CUBIC = [
    "modified-hermite",
    "cubic",
    "bspline",
    "bspline-velocity",
    "parabolic-blend",
    "trapezoidal",
]


@pytest.mark.parametrize("planner", CUBIC)
def test_knots_define_cubics(planner: str) -> None:
    points = motion_points(motion(planner))
    assert points.exact
    assert points.inserted == 0
    assert points.trajectory is motion(planner)
    assert points.error < 1e-14
    assert "define the whole motion exactly" in points.describe()


@pytest.mark.parametrize("planner", sorted(set(PLANNERS) - set(CUBIC)))
def test_knots_do_not_define_more(planner: str) -> None:
    with pytest.raises(ExportError, match="fit"):
        motion_points(motion(planner))


@pytest.mark.parametrize("planner", sorted(set(PLANNERS) - set(CUBIC)))
@pytest.mark.parametrize("accelerations", [False, True])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-7])
def test_a_fit_meets_its_tolerance(planner: str, accelerations: bool, tolerance: float) -> None:
    trajectory = motion(planner)
    points = motion_points(trajectory, accelerations=accelerations, fit=tolerance)
    dense = np.linspace(trajectory.start_time, trajectory.end_time, 30001)
    off = np.abs(points.trajectory(dense) - trajectory(dense)).max()
    slow = np.abs(points.trajectory(dense, 1) - trajectory(dense, 1)).max()
    assert off <= points.error + 1e-13
    assert slow <= points.velocity_error + 1e-11
    assert points.error <= tolerance
    inside = dense[~np.isin(dense, points.trajectory.breaks)]
    accelerations_off = np.abs(points.trajectory(inside, 2) - trajectory(inside, 2)).max()
    assert accelerations_off <= points.acceleration_error + 1e-9
    assert points.acceleration_error <= 1.2 * accelerations_off + 1e-9
    ending = "C2" if accelerations else "C1: the acceleration jumps"
    assert points.exact or points.describe().endswith(ending)
    if off > 1e-10:
        assert points.error <= 1.01 * off
    assert points.count == trajectory.breaks.size + points.inserted
    assert points.trajectory.continuity.order >= (2 if accelerations else 1)


def test_a_fit_takes_few_points() -> None:
    """The error falls with the fourth power: a hundredfold tolerance, about 3.2 times fewer."""
    counts = [
        motion_points(motion("quintic"), fit=tolerance).count for tolerance in (1e-4, 1e-6, 1e-8)
    ]
    assert 2.0 < counts[1] / counts[0] < 5.0
    assert 2.0 < counts[2] / counts[1] < 5.0


@given(hermite_data(), st.floats(1e-9, 1e-1))
@examples()
def test_a_fit_of_what_is_exact_inserts_nothing(
    trajectory: JointTrajectory, tolerance: float
) -> None:
    points = motion_points(trajectory, fit=tolerance)
    assert points.exact
    assert points.inserted == 0


@pytest.mark.parametrize(
    "fit",
    [0.0, -1e-3, float("nan"), float("inf"), "wide", "1e-3", True, 10**400, 1j, [1e-3], 1e-30],
)
def test_tolerances_that_can_not_be(fit: float) -> None:
    with pytest.raises(InputError):
        motion_points(motion("quintic"), fit=fit)


def test_a_tolerance_that_takes_too_many_points(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("knotwork.files.export.lossless.MOST_EXPORTED_POINTS", 50)
    with pytest.raises(InputError, match="more than 50 points"):
        motion_points(motion("quintic"), fit=1e-9)


@pytest.mark.parametrize("order", [0, 1])
def test_a_jump_is_no_point(order: int) -> None:
    c = np.zeros((4, 2, 1))
    c[3 - order, 1, 0] = 1.0
    trajectory = JointTrajectory(("a",), PiecewisePolynomial(c, [0.0, 1.0, 2.0]))
    unit = ("rad", "rad/s")[order]
    for fit in (None, 1e-3):
        with pytest.raises(ExportError, match=f"'a' jumps by 1 {unit} at 1 s") as got:
            motion_points(trajectory, fit=fit)
        assert (got.value.joint, got.value.error, got.value.time) == ("a", 1.0, 1.0)
