"""What is promised of each planner, measured on its motions; options it takes or refuses."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from planner_cases import random_waypoints

from judged import judged_joints
from knotwork.curves.interpolation import PLANNER_SPECS, PLANNERS, PlannerOptions, get_planner
from knotwork.errors import InputError, OptionError, UnknownNameError
from knotwork.waypoints import JointWaypoints
from sweeps import examples

ALL_VELOCITIES = {
    *("modified-hermite", "cubic", "quintic", "septic", "nonic", "bspline-velocity", "3-5-3"),
}
END_VELOCITIES = ALL_VELOCITIES | {"parabolic-blend", "bspline", "4-3-4"}
ALL_POSITIONS = set(PLANNERS) - {"parabolic-blend"}


JUDGED = {"tolerances": {"joint_velocity": 1e-5}}
"""Since 1970 a rounding of the time moves a fast joint by this much [rad/s]."""


def unpromised(name):
    """Kinds of wrongs that the judge may find, since the planner says so."""
    kept = {"pose": name in ALL_POSITIONS, "velocity": name in ALL_VELOCITIES}
    kept["jump"] = PLANNER_SPECS[name].continuity >= 2
    return [kind for kind, keeps in kept.items() if not keeps]


CASE = random_waypoints(6)


def plan(name, waypoints=CASE, **options):
    return get_planner(name)(waypoints, PlannerOptions(**options))


def can(name, n):
    return not (name == "3-5-3" and n == 3)


def check_promises(name, waypoints, **options):
    trajectory = plan(name, waypoints, **options)
    record = PLANNER_SPECS[name]
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    assert trajectory.origin == name
    np.testing.assert_array_equal(trajectory.waypoint_times, t)
    assert (trajectory.start_time, trajectory.end_time) == (t[0], t[-1])
    assert trajectory.polynomial.degree <= record.degree
    assert trajectory.continuity.order >= record.continuity
    at = slice(None) if name in ALL_POSITIONS else [0, -1]
    scale = np.abs(y).max()
    np.testing.assert_allclose(trajectory(t, 0)[at], y[at], rtol=0, atol=1e-10 * scale)
    speed = trajectory.extrema("velocity").peak.max()
    if name in END_VELOCITIES:
        at = slice(None) if name in ALL_VELOCITIES else [0, -1]
        np.testing.assert_allclose(trajectory(t, 1)[at], v[at], rtol=0, atol=1e-9 * speed)
    else:
        np.testing.assert_allclose(trajectory(t, 1), 0.0, rtol=0, atol=1e-9 * speed)
    assert not judged_joints(trajectory, waypoints, unpromised(name), **JUDGED)
    return trajectory


@examples(in_all=360)
@given(
    st.sampled_from(list(PLANNERS)),
    st.integers(2, 12),
    st.floats(1.0, 100.0),
    st.integers(0, 10**6),
)
def test_promises_hold_for_uneven_times(name, n, ratio, seed):
    if can(name, n):
        check_promises(name, random_waypoints(n, seed, joints=2, ratio=ratio))


@pytest.mark.parametrize("name", PLANNERS)
def test_it_is_no_smoother_than_it_says(name):
    trajectory = plan(name, random_waypoints(9))
    assert trajectory.continuity.order == PLANNER_SPECS[name].continuity
    assert trajectory.polynomial.degree == {"4-3-4": 4}.get(name, PLANNER_SPECS[name].degree)


@pytest.mark.parametrize("name", PLANNERS)
def test_promises_hold_at_the_time_of_day(name):
    """Times in seconds since 1970 are resolved to a quarter of a microsecond."""
    case = random_waypoints(9)
    later = JointWaypoints(
        case.joint_names, np.round(case.time, 3) + 1.7e9, case.position, case.velocity
    )
    check_promises(name, later)


@pytest.mark.parametrize("name", sorted(set(PLANNERS) - ALL_VELOCITIES))
def test_what_can_not_be_met_is_missed(name):
    waypoints = random_waypoints(6)
    trajectory = plan(name, waypoints)
    assert np.abs(trajectory.velocity(waypoints.time) - waypoints.velocity)[1:-1].min() > 1e-5
    miss = np.abs(trajectory.position(waypoints.time) - waypoints.position)[1:-1]
    assert miss.min() > 1e-4 if name == "parabolic-blend" else miss.max() < 1e-12


@pytest.mark.parametrize("name", PLANNERS)
def test_values_out_of_range_are_an_error_and_no_nan(name):
    waypoints = JointWaypoints(
        ("a",), [0.0, 1e-200, 2e-200, 3e-200], [[0.0], [1e200], [-1e200], [0.0]], np.ones((4, 1))
    )
    with pytest.raises(InputError, match=r"floating-point|finite|short|resol"):
        plan(name, waypoints)


GIVEN = {
    "knots": "balanced",
    "end_acceleration": "zero",
    "accelerations": "estimated",
}


@pytest.mark.parametrize("option", GIVEN)
@pytest.mark.parametrize("name", PLANNERS)
def test_an_option_is_supported_or_refused(name, option):
    options = {option: GIVEN[option]}
    if option not in PLANNER_SPECS[name].supports:
        with pytest.raises(OptionError, match=f"planner '{name}': .*is not supported") as caught:
            plan(name, **options)
        message = str(caught.value)
        assert (caught.value.option, caught.value.planner) == (option, name)
        assert f"option {option} " in message
        others = (other for other, spec in PLANNER_SPECS.items() if option in spec.supports)
        assert message.endswith(f"; leave it out, or use one of: {', '.join(others)}")
        others = [other for other, record in PLANNER_SPECS.items() if option in record.supports]
        assert others
        assert all(other in message for other in others)
        return
    changed, default = plan(name, **options), plan(name)
    same = (
        changed.breaks.shape == default.breaks.shape
        and changed.polynomial.c.shape == default.polynomial.c.shape
        and np.array_equal(changed.polynomial.c, default.polynomial.c)
    )
    # zero end accelerations and estimated inner ones are defaults of some
    defaults = {("3-5-3", "accelerations"), ("4-3-4", "end_acceleration")}
    high = name in ("quintic", "septic", "nonic") and option == "end_acceleration"
    assert same == (high or (name, option) in defaults)


@pytest.mark.parametrize("name", ["quintic", "septic", "nonic"])
def test_end_accelerations_take_the_place_of_presets(name):
    trajectory = plan(name, accelerations="estimated", end_acceleration=(1.5, [1, 2, 3]))
    np.testing.assert_allclose(trajectory.acceleration(CASE.time[0]), 1.5, atol=1e-9)
    np.testing.assert_allclose(trajectory.acceleration(CASE.time[-1]), [1, 2, 3], atol=1e-8)
    with pytest.raises(OptionError, match=r"planner.*end_acceleration gives .*accelerations"):
        plan(name, accelerations=np.zeros((6, 3)), end_acceleration="zero")


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [
        ("quintic", {"accelerations": np.zeros((5, 3))}, r"5 rows \(shape \(5, 3\)\).*6, 3"),
        ("quintic", {"accelerations": 1.0}, r"accelerations has no rows \(shape \(\)\)"),
        ("3-5-3", {"accelerations": np.zeros((6, 3))}, "for each waypoint; accepted: zero"),
        ("4-3-4", {"end_acceleration": "none"}, "'none'; it must be None, 'zero'"),
        ("modified-hermite", {"end_acceleration": "none"}, "'none'; it must be None, 'zero'"),
        ("modified-hermite", {"end_acceleration": ([1, 2], 0)}, r"end_acceleration has the start"),
        ("4-3-4", {"end_acceleration": (1, 2, 3)}, "pair"),
        ("4-3-4", {"end_acceleration": ([1, 2], 0)}, "end_acceleration has the start"),
        ("quintic", {"end_acceleration": (0, float("nan"))}, "end_acceleration has the end nan"),
        ("quintic", {"end_acceleration": ("x", 0)}, "must be numbers"),
    ],
)
def test_options_of_the_wrong_shape_are_an_error_that_names_planner_and_option(name, options, says):
    with pytest.raises(OptionError, match=says) as caught:
        plan(name, **options)
    assert str(caught.value).startswith(f"planner '{name}': option {next(iter(options))} ")


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"accelerations": "guessed"}, "estimated"),
        ({"accelerations": [[0.0, float("nan")]]}, r"accelerations at \[0, 1\] is nan.*finite"),
        ({"accelerations": [[1.0], [2.0, 3.0]]}, "differ in length"),
        ({"accelerations": [[1j]]}, "real numbers"),
    ],
)
def test_values_that_can_not_be_are_an_error(options, says):
    with pytest.raises(OptionError, match=says):
        PlannerOptions(**options)


def test_options_with_arrays_can_be_compared_and_are_kept():
    given = np.ones((2, 1))
    one, same = PlannerOptions(accelerations=given), PlannerOptions(accelerations=[[1], [1]])
    assert one == same
    assert hash(one) == hash(same)
    assert one != PlannerOptions()
    assert one != PlannerOptions(accelerations=[[1], [2]])
    assert one != "options"
    given[0] = 5.0
    assert one == same
    assert one.requested == ("accelerations",)


class TestRules:
    def test_a_rule_after_the_name_is_the_option(self):
        ruled = get_planner("quintic:estimated")(CASE)
        estimated = plan("quintic", accelerations="estimated")
        np.testing.assert_array_equal(ruled.polynomial.c, estimated.polynomial.c)
        assert ruled.origin == "quintic:estimated"
        balanced = get_planner("modified-hermite:balanced")(CASE, PlannerOptions())
        np.testing.assert_array_equal(
            balanced.breaks, plan("modified-hermite", knots="balanced").breaks
        )

    def test_other_options_hold_beside_it(self):
        ruled = get_planner("septic:estimated")(CASE, PlannerOptions(end_acceleration="zero"))
        assert np.abs(ruled.acceleration(CASE.time[[0, -1]])).max() < 1e-9
        assert np.abs(ruled.acceleration(CASE.time[1])).max() > 1e-3

    def test_the_option_beside_it_is_an_error(self):
        with pytest.raises(
            OptionError, match=r"quintic:estimated.*together with the rule 'estimated'"
        ):
            get_planner("quintic:estimated")(CASE, PlannerOptions(accelerations="zero"))
        get_planner("quintic:estimated")(CASE, PlannerOptions(accelerations="estimated"))

    @pytest.mark.parametrize(
        ("name", "says"),
        [
            ("quintik:zero", "unknown planner 'quintik'; did you mean 'quintic'"),
            ("quintic:estimate", "rule of planner 'quintic' 'estimate'; did you mean 'estimated'"),
            ("quintic:balanced", "rule of planner 'quintic' 'balanced'; accepted: zero, estimated"),
            ("quintic:", "rule of planner 'quintic' ''"),
            ("cubic:zero", "unknown planner 'cubic:zero'.*cubic, modified-hermite:RULE"),
            (3, "unknown planner '3'"),
            (None, "unknown planner 'None'"),
        ],
    )
    def test_an_unknown_one_is_an_error_that_says_what_there_is(self, name, says):
        with pytest.raises(UnknownNameError, match=says):
            get_planner(name)


def test_353_refuses_three_waypoints():
    with pytest.raises(InputError, match=r"three waypoints.*modified-hermite"):
        plan("3-5-3", random_waypoints(3))


@pytest.mark.parametrize("name", ["parabolic-blend", "trapezoidal"])
def test_intervals_below_the_resolution_of_times_are_an_error(name):
    y = np.array([[0.0], [1.0]])
    with pytest.raises(InputError, match=r"change of speed at 1000000000.* s is .*resolution"):
        plan(name, JointWaypoints(("elbow",), [1e9, 1e9 + 2e-7], y, 0 * y))
