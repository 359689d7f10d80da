"""Trajectories and the waypoints that they are made of: what a user may build."""

from __future__ import annotations

import copy
import dataclasses
import pickle

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from knotwork.curves.interpolation import ModifiedHermiteSpline
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError, TimeRangeError, UnknownNameError, WaypointDataError
from knotwork.waypoints import CartesianWaypoint
from sweeps import examples

NAMES = ("shoulder", "elbow")
# Relative jumps below it are rounding.
CONTINUITY_TOLERANCE = 1e-9
# The end replaces a sample that is nearer, in periods.
SAMPLE_COINCIDENCE = 1e-6


@pytest.fixture(scope="module")
def trajectory():
    rng = np.random.default_rng(0)
    x = np.array([1.0, 2.0, 4.5, 5.0, 7.0])
    spline = ModifiedHermiteSpline(x, rng.normal(size=(5, 2)), rng.normal(size=(5, 2)))
    return JointTrajectory(NAMES, spline, origin="modified-hermite", waypoint_times=x)


def test_quantities_are_the_derivatives_in_order(trajectory):
    t = np.linspace(1, 7, 50).reshape(5, 10)
    names = ("position", "velocity", "acceleration", "jerk")
    for nu, name in enumerate(names):
        values = getattr(trajectory, name)(t)
        assert values.shape == (5, 10, 2)
        np.testing.assert_array_equal(values, trajectory(t, nu))
        np.testing.assert_array_equal(values, trajectory.polynomial(t, nu))
    assert trajectory.position(2.0).shape == (2,)


@pytest.mark.parametrize("t", [np.nextafter(1.0, 0.0), np.nextafter(7.0, 8.0), np.nan])
def test_not_one_rounding_outside(trajectory, t):
    for function in (trajectory, trajectory.position, trajectory.jerk):
        with pytest.raises(TimeRangeError, match=r"defined from 1 s to 7 s"):
            function([2.0, t])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"joint_names": ("a",), "joint_units": ()}, r"1 joints need .*\(1,\).* not \(2,\)"),
        ({"joint_names": ("a", "a")}, "each once"),
        ({"joint_names": ()}, "each once"),
        ({"joint_units": ("rad",)}, "'rad' or 'm' for each of 2"),
        ({"joint_units": ("rad", "deg")}, "'rad' or 'm'"),
        ({"waypoint_times": [0.5, 2.0]}, "from 0.5 s to 2 s.*from 1 s to 7 s"),
        ({"waypoint_times": [2.0, 1.0]}, "later than"),
    ],
)
def test_what_does_not_fit_together_is_refused(trajectory, arguments, says):
    with pytest.raises(InputError, match=says):
        dataclasses.replace(trajectory, **arguments)


def test_needs_one_trailing_axis():
    with pytest.raises(InputError, match="trailing shape"):
        JointTrajectory(("a",), PiecewisePolynomial([[1.0]], [0, 1]))
    moved = PiecewisePolynomial(np.ones((2, 1, 1)), [0, 1], axis=1)
    with pytest.raises(InputError, match="axis 1"):
        JointTrajectory(NAMES, moved)


def test_joints_in_another_order_are_the_same_motion(trajectory):
    mixed = dataclasses.replace(trajectory, joint_units=np.array(["rad", "m"]))
    other = mixed.reordered(NAMES[::-1], ("m", "rad"))
    t = np.linspace(1, 7, 50)
    for nu in range(4):
        np.testing.assert_array_equal(other(t, nu), mixed(t, nu)[:, ::-1])
    assert (other.joint_names, other.joint_units) == (NAMES[::-1], ("m", "rad"))
    assert other.origin == mixed.origin
    np.testing.assert_array_equal(other.waypoint_times, mixed.waypoint_times)
    assert mixed.reordered(NAMES) is mixed
    with pytest.raises(InputError, match=r"lacks joint hand and has joint elbow; .* robot 'r'"):
        mixed.reordered(("shoulder", "hand"), owner="robot 'r'")
    with pytest.raises(InputError, match="gives joint 'elbow' in m; the scenario has it in rad"):
        mixed.reordered(NAMES, ("rad", "rad"))


# ---- knots --------------------------------------------------------------------------------------


def test_knots_carry_the_whole_curve(trajectory):
    knots = trajectory.knots
    again = JointTrajectory.from_knots(
        NAMES, knots.time, knots.position, knots.velocity, origin="again"
    )
    np.testing.assert_allclose(
        again.polynomial.c, trajectory.polynomial.c, atol=1e-12 * np.abs(again.polynomial.c).max()
    )
    np.testing.assert_allclose(again.knots.acceleration, knots.acceleration, atol=1e-12)
    assert again.continuity.order == 2
    assert again.origin == "again"


@pytest.mark.parametrize(
    ("t", "r", "v", "says"),
    [
        ([0, 0], np.zeros((2, 2)), np.zeros((2, 2)), "later than"),
        ([0, 1], np.zeros((2, 3)), np.zeros((2, 2)), r"position must have shape \(2, 2\)"),
        ([0, 1], np.zeros((2, 2)), np.full((2, 2), np.nan), r"velocity\[0, 0\] is nan"),
    ],
)
def test_from_knots_refuses_bad_data(t, r, v, says):
    with pytest.raises(WaypointDataError, match=says):
        JointTrajectory.from_knots(NAMES, t, r, v)


# ---- continuity ---------------------------------------------------------------------------------


def powers(x, order, jump):
    """Degree 5 and, beyond x[1], one term of the given order more that makes it jump there."""
    base = np.array([0.3, -1.0, 0.5, 2.0, -0.7, 0.1])
    left = np.polynomial.Polynomial(base[::-1])
    right = left(np.polynomial.Polynomial([x[1] - x[0], 1.0])).coef[::-1].copy()
    right[-1 - order] += jump
    return np.stack((base, right), axis=1)


@pytest.mark.parametrize("order", range(6))
def test_order_is_one_less_than_the_first_derivative_that_jumps(order):
    x = [0.0, 0.8, 2.0]
    both = np.stack((powers(x, 0, 0.0), powers(x, order, 1e-3)), axis=2)
    continuity = JointTrajectory(NAMES, PiecewisePolynomial(both, x)).continuity
    assert continuity.order == order - 1
    measured = [continuity.position, continuity.velocity, continuity.acceleration]
    for nu, jump in enumerate(measured):
        if nu == order:
            assert (jump.joint, jump.time) == ("elbow", 0.8)
            assert jump.jump == pytest.approx(1e-3 * [1, 1, 2][order], rel=1e-9)
            peak = JointTrajectory(NAMES, PiecewisePolynomial(both, x)).extrema(nu).peak[1]
            assert jump.relative == pytest.approx(jump.jump / peak, rel=1e-12)
        else:
            assert jump.relative < CONTINUITY_TOLERANCE


def test_jumps_at_the_tolerance():
    x = [0.0, 0.8, 2.0]
    for factor, order in ((0.5, 5), (2.0, -1)):
        curve = PiecewisePolynomial(powers(x, 0, 0.0)[..., None], x)
        peak = min(float(curve.extrema().peak[0]), 1.0)  # above, the tolerance is absolute
        c = powers(x, 0, factor * CONTINUITY_TOLERANCE * peak)[..., None]
        assert JointTrajectory(("a",), PiecewisePolynomial(c, x)).continuity.order == order


def test_a_jump_of_a_quantity_that_is_zero_elsewhere_counts():
    c = np.zeros((1, 2, 1))
    c[0, 1] = 1e-6
    curve = JointTrajectory(("a",), PiecewisePolynomial(c, [0, 1, 2]))
    assert curve.continuity.order == -1
    assert curve.continuity.position.relative == 1.0


# ---- extrema ------------------------------------------------------------------------------------


def test_unknown_quantity(trajectory):
    with pytest.raises(UnknownNameError, match="did you mean 'velocity'"):
        trajectory.extrema("velocities")
    with pytest.raises(InputError, match="integer"):
        trajectory.extrema(-1)


# ---- samples ------------------------------------------------------------------------------------


def test_samples_are_the_curve_at_their_times(trajectory):
    samples = trajectory.sample(7.3)
    assert samples.time[0] == 1.0
    assert samples.time[-1] == 7.0
    np.testing.assert_allclose(np.diff(samples.time)[:-1], 1 / 7.3, rtol=1e-12)
    names = ("position", "velocity", "acceleration", "jerk")
    for nu, name in enumerate(names):
        np.testing.assert_array_equal(getattr(samples, name), trajectory(samples.time, nu))


@examples(in_all=300)
@given(
    start=st.floats(-1e3, 1e3),
    duration=st.floats(1e-2, 1e2),
    rate=st.floats(1e-3, 1e3),
)
def test_sample_times_of_any_rate(start, duration, rate):
    end = start + duration
    still = JointTrajectory(("a",), PiecewisePolynomial([[[0.0]]], [start, end]))
    t = still.sample(rate).time
    step = np.diff(t)
    assert t[0] == start
    assert t[-1] == end
    assert (step > 0.5 * SAMPLE_COINCIDENCE / rate).all()
    assert (step <= (1 + 2 * SAMPLE_COINCIDENCE) / rate).all()
    np.testing.assert_allclose(step[:-1], 1 / rate, rtol=0, atol=1e-12)


@pytest.mark.parametrize("rate", [0, -1, np.nan, np.inf, "fast", None, 1j, [1, 2]])
def test_bad_rates(trajectory, rate):
    with pytest.raises(InputError, match="sample rate"):
        trajectory.sample(rate)


def test_too_many_samples_are_refused_with_the_rate_that_would_do(trajectory):
    with pytest.raises(InputError, match=r"at most 20000000 are taken.*Hz"):
        trajectory.sample(1e12)


POSE = pin.SE3(pin.rpy.rpyToMatrix(0.1, -0.4, 2.0), np.array([0.4, 0.1, 0.3]))
TWIST = pin.Motion(np.array([0.1, 0.0, -0.2]), np.array([0.0, 0.5, 0.0]))


def test_a_waypoint_holds_its_pose_and_twist() -> None:
    waypoint = CartesianWaypoint("on", 1.5, POSE, TWIST)
    for same in (waypoint, copy.deepcopy(waypoint), pickle.loads(pickle.dumps(waypoint))):
        assert same.pose.isApprox(POSE, 0.0)
        assert same.twist.isApprox(TWIST, 0.0)
        np.testing.assert_array_equal(same.position, [0.4, 0.1, 0.3])
        np.testing.assert_array_equal(same.rotation, POSE.rotation)
        np.testing.assert_array_equal(same.linear, [0.1, 0, -0.2])
        np.testing.assert_array_equal(same.angular, [0, 0.5, 0])


def test_a_waypoint_does_not_change_with_what_it_was_made_of() -> None:
    pose, twist = POSE.copy(), TWIST.copy()
    waypoint = CartesianWaypoint("on", 1.5, pose, twist)
    pose.translation[0] = 9
    twist.linear[0] = 9
    waypoint.position[0] = 9
    assert waypoint.pose.isApprox(POSE, 0.0)
    assert waypoint.twist.isApprox(TWIST, 0.0)
    with pytest.raises(AttributeError):
        setattr(waypoint, "pose", pose)  # noqa: B010


SHEARED = pin.SE3(np.array([[1.0, 0.1, 0], [0, 1, 0], [0, 0, 1]]), np.zeros(3))
LEFT_HANDED = pin.SE3(np.diag([1.0, 1.0, -1.0]), np.zeros(3))
FAR = pin.SE3(np.eye(3), np.array([0, np.inf, 0]))
NOT_KNOWN = pin.Motion(np.array([np.nan, 0, 0]), np.zeros(3))


@pytest.mark.parametrize(
    ("pose", "twist", "says"),
    [
        (np.eye(4), TWIST, "on: pose must be a pin.SE3"),
        (POSE, np.zeros(6), "on: twist must be a pin.Motion"),
        (POSE, None, "on: twist must be a pin.Motion, not None"),
        (FAR, TWIST, "on: pose.* is inf; every value must be finite"),
        (POSE, NOT_KNOWN, "on: twist.* is nan; every value must be finite"),
        (SHEARED, TWIST, "R'R differs from I by 0.1"),
        (LEFT_HANDED, TWIST, "det R = -1"),
    ],
)
def test_what_is_no_waypoint_is_refused(pose, twist, says: str) -> None:
    with pytest.raises(WaypointDataError, match=says):
        CartesianWaypoint("on", 1.5, pose, twist)


def test_waypoint_has_a_time() -> None:
    for time, says in ((np.nan, "on: time is nan"), ("soon", "on: time must be numbers")):
        with pytest.raises(WaypointDataError, match=says):
            CartesianWaypoint("on", time, POSE, TWIST)
