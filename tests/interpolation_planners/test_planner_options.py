"""Options: what is supported, what is refused, and limits that shape a motion."""

from __future__ import annotations

import numpy as np
import pytest
from planner_cases import paper_waypoints, random_waypoints

from knotwork.errors import InputError, OptionError, UnknownNameError
from knotwork.interpolation import PLANNER_SPECS, PLANNERS, PlannerOptions, get_planner
from knotwork.waypoints import JointWaypoints

CASE = random_waypoints(6)
GIVEN = {
    "knots": "balanced",
    "end_acceleration": "zero",
    "accelerations": "estimated",
    "jerks": np.ones((6, 3)),
    "snaps": np.ones((6, 3)),
    "transition_time": 0.05,
}


def plan(name, waypoints=CASE, **options):
    return get_planner(name)(waypoints, PlannerOptions(**options))


@pytest.mark.parametrize("option", GIVEN)
@pytest.mark.parametrize("name", PLANNERS)
def test_an_option_is_supported_or_refused(name, option):
    options = {option: GIVEN[option]}
    if option not in PLANNER_SPECS[name].supports:
        with pytest.raises(OptionError, match=f"planner '{name}': .*does not support") as caught:
            plan(name, **options)
        message = str(caught.value)
        assert (caught.value.option, caught.value.planner) == (option, name)
        assert f"option {option} " in message
        assert all(own in message for own in PLANNER_SPECS[name].supports)
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


@pytest.mark.parametrize("name", PLANNERS)
def test_limits_are_context_that_every_planner_accepts(name):
    wide = np.full(3, 1e4)
    loose = plan(name, velocity_limit=wide, acceleration_limit=wide)
    none = plan(name, velocity_limit=np.full(3, np.inf), acceleration_limit=np.full(3, np.inf))
    np.testing.assert_array_equal(none.polynomial.c, plan(name).polynomial.c)
    if "acceleration_limit" not in PLANNER_SPECS[name].supports:
        np.testing.assert_array_equal(loose.polynomial.c, none.polynomial.c)


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
        ("septic", {"jerks": np.zeros(6)}, r"jerks has 6 rows \(shape \(6,\)\)"),
        ("nonic", {"snaps": np.zeros((3, 6))}, r"snaps .*shape \(3, 6\)"),
        ("3-5-3", {"accelerations": np.zeros((6, 3))}, r"\(6, 3\).*take 2 \(shape \(2, 3\)\)"),
        ("4-3-4", {"end_acceleration": "none"}, "'none'; it must be None, 'zero'"),
        ("modified-hermite", {"end_acceleration": "none"}, "'none'; it must be None, 'zero'"),
        ("modified-hermite", {"end_acceleration": ([1, 2], 0)}, r"end_acceleration has the start"),
        ("4-3-4", {"end_acceleration": (1, 2, 3)}, "pair"),
        ("4-3-4", {"end_acceleration": ([1, 2], 0)}, "end_acceleration has the start"),
        ("quintic", {"end_acceleration": (0, float("nan"))}, "end_acceleration has the end nan"),
        ("quintic", {"end_acceleration": ("x", 0)}, "must be numbers"),
        ("parabolic-blend", {"transition_time": [0.1, 0.2]}, r"shape \(2,\).*6 waypoints"),
        ("parabolic-blend", {"acceleration_limit": [1.0, 2.0]}, r"shape \(2,\).*3 joints"),
        ("trapezoidal", {"velocity_limit": 1.0}, r"shape \(\).*3 joints"),
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
        ({"jerks": [[1.0], [2.0, 3.0]]}, "differ in length"),
        ({"snaps": "zero"}, "real numbers"),
        ({"snaps": [[1j]]}, "real numbers"),
        ({"transition_time": 0.0}, "positive"),
        ({"transition_time": [1.0, -1.0]}, r"transition_time at \[1\].*positive"),
        ({"transition_time": float("inf")}, "finite"),
        ({"velocity_limit": [1.0, float("nan")]}, "not NaN"),
        ({"acceleration_limit": [0.0]}, "positive"),
    ],
)
def test_values_that_can_not_be_are_an_error(options, says):
    with pytest.raises(OptionError, match=says):
        PlannerOptions(**options)


def test_a_rule_that_is_not_known_names_those_that_are():
    with pytest.raises(OptionError, match="did you mean 'estimated'"):
        PlannerOptions(accelerations="estimate")


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
    assert PlannerOptions(velocity_limit=[1.0]).requested == ()
    with pytest.raises(ValueError, match="read-only"):
        one.accelerations[0] = 2.0


class TestRules:
    def test_a_rule_after_the_name_is_the_option(self):
        ruled = get_planner("quintic:estimated")(CASE)
        said = plan("quintic", accelerations="estimated")
        np.testing.assert_array_equal(ruled.polynomial.c, said.polynomial.c)
        assert ruled.planner == "quintic:estimated"
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


def test_353_refuses_three_waypoints_and_presets_where_none_are_free():
    with pytest.raises(InputError, match=r"three waypoints.*modified-hermite"):
        plan("3-5-3", random_waypoints(3))
    with pytest.raises(InputError, match=r"4 waypoints of 3 joints take 0 \(shape \(0, 3\)\)"):
        plan("3-5-3", random_waypoints(4), accelerations=np.zeros((4, 3)))


def one_joint(time, position, velocity=None):
    y = np.array(position, dtype=float)[:, None]
    v = np.zeros_like(y) if velocity is None else np.array(velocity, dtype=float)[:, None]
    return JointWaypoints(("elbow",), time, y, v, names=tuple("ABCDEFGH"[: len(time)]))


def test_trapezoids_use_the_limit_of_acceleration_fully():
    limit = np.array([9.0, np.inf, 12.0])
    trajectory = plan("trapezoidal", acceleration_limit=limit)
    assert (trajectory.extrema("acceleration").peak <= limit * (1 + 1e-9)).all()
    c, breaks = trajectory.polynomial.c, trajectory.breaks
    use = np.abs(2 * c[0]) / limit
    for low, high in zip(CASE.time[:-1], CASE.time[1:], strict=True):
        inside = (breaks[:-1] >= low) & (breaks[:-1] < high)
        assert use[inside].max() == pytest.approx(1.0, rel=1e-9)


def test_trapezoids_keep_a_limit_of_speed():
    move = one_joint([0, 2], [0, 1])
    assert plan("trapezoidal", move).extrema("velocity").peak[0] == pytest.approx(0.75)
    limited = plan("trapezoidal", move, velocity_limit=[0.6])
    assert limited.extrema("velocity").peak[0] == pytest.approx(0.6)
    with pytest.raises(InputError, match=r"'elbow'.*'A'.*'B'.*velocity_limit 0\.5 .* 0\.5 .*more"):
        plan("trapezoidal", move, velocity_limit=[0.5])
    with pytest.raises(InputError, match=r"velocity_limit 0\.6 is below.*needs 0\.[0-9]* s more"):
        plan("trapezoidal", move, velocity_limit=[0.6], acceleration_limit=[1.2])


def test_trapezoids_that_need_more_acceleration_say_how_much_and_how_long():
    move = one_joint([0, 1, 2], [0, 0.1, 1.1])
    triangle = plan("trapezoidal", move, acceleration_limit=[4.0])
    assert triangle.breaks.size == 6
    assert triangle.extrema("acceleration").peak[0] == pytest.approx(4.0)
    says = r"'elbow'.*'B' \(1 s\) to 'C' \(2 s\).*acceleration_limit 1 is below the 4.*1 s more"
    with pytest.raises(InputError, match=says):
        plan("trapezoidal", move, acceleration_limit=[1.0])
    longer = one_joint([0, 1, 3], [0, 0.1, 1.1])
    assert plan("trapezoidal", longer, acceleration_limit=[1.0]).continuity.order == 1


def test_trapezoids_go_straight_in_joint_space():
    trajectory = plan("trapezoidal", acceleration_limit=[3.0, 5.0, np.inf])
    t = np.linspace(CASE.time[1], CASE.time[2], 50)
    away = trajectory.position(t) - CASE.position[1]
    along = CASE.position[2] - CASE.position[1]
    assert np.abs(np.cross(away, along)).max() < 1e-12


@pytest.mark.parametrize("n", [2, 3, 4, 9])
@pytest.mark.parametrize("seed", range(8))
def test_blends_are_the_shortest_that_keep_the_limits(n, seed):
    waypoints = random_waypoints(n, seed)
    limit = np.array([60.0, 80.0, np.inf])
    trajectory = plan("parabolic-blend", waypoints, acceleration_limit=limit)
    use = np.abs(2 * trajectory.polynomial.c[0]) / limit
    assert use.max() <= 1 + 1e-9
    transitions = use[::2].max(axis=1)
    if n == 2:
        assert transitions.max() == pytest.approx(1.0, rel=1e-9)
    else:
        np.testing.assert_allclose(transitions, 1.0, rtol=1e-9)


def test_blends_that_do_not_fit_say_which_interval_and_by_how_much():
    case = paper_waypoints()
    with pytest.raises(
        InputError, match=r"'0' \(0 s\) to '1' \(5 s\).*is 1 s too short.*4 s and 2"
    ):
        plan("parabolic-blend", case, transition_time=4.0)
    with pytest.raises(InputError, match=r"'1' \(5 s\) to '2' \(15 s\).* 0\.5 s too short"):
        plan("parabolic-blend", case, transition_time=[1, 8, 13, 1])
    with pytest.raises(InputError, match=r"'joint_1'.*acceleration_limit 2 is below the 2\.4"):
        plan("parabolic-blend", case, acceleration_limit=[2.0])
    full = plan("parabolic-blend", case, transition_time=[1, 8, 12, 4])
    np.testing.assert_array_equal(full.breaks, [0, 1, 9, 21, 25])
    assert full.continuity.order == 1
    single = one_joint([0, 1], [0, 1])
    assert plan("parabolic-blend", single, acceleration_limit=[4.0]).breaks.size == 3
    with pytest.raises(InputError, match=r"acceleration_limit 3\.9 .* 4 is sufficient"):
        plan("parabolic-blend", single, acceleration_limit=[3.9])
    with pytest.raises(InputError, match="too short for the resolution"):
        plan("parabolic-blend", one_joint([1e6, 1e6 + 1], [0, 1]), transition_time=1e-12)


def test_blends_without_limits_take_a_third_of_the_shortest_adjoining_interval():
    trajectory = plan("parabolic-blend", paper_waypoints())
    third = 1 / 3
    expected = [0, 5 * third, 5 - 5 * third / 2, 5 + 5 * third / 2]
    expected += [15 - 5 * third, 15 + 5 * third, 25 - 10 * third, 25]
    np.testing.assert_allclose(trajectory.breaks, expected, atol=1e-12)


def test_blends_leave_out_corners_that_are_none():
    straight = one_joint([0, 1, 3, 4], [0, 1, 3, 4], [1, 0, 0, 1])
    trajectory = plan("parabolic-blend", straight, acceleration_limit=[2.0])
    assert trajectory.extrema("acceleration").peak[0] < 1e-12
    bent = one_joint([0, 1, 3, 4], [0, 1, 3, 3], [1, 0, 0, 0])
    assert plan("parabolic-blend", bent).extrema("acceleration").peak[0] > 0.1


@pytest.mark.parametrize("seed", range(60))
def test_blends_of_a_single_interval_against_a_search(seed):
    random = np.random.default_rng(seed)
    d, h = random.integers(1, 4), random.uniform(0.5, 2.0)
    y, v = random.normal(size=(2, d)), random.normal(size=(2, d)) * random.integers(0, 2)
    limit = random.uniform(1.0, 12.0, d)
    times = np.linspace(1e-3, 0.5, 500)[:, None] * h
    slope = (y[1] - y[0] - (v[0] + v[1]) * times / 2) / (h - times)
    use = np.maximum(np.abs(slope - v[0]), np.abs(v[1] - slope)) / times / limit
    feasible = (use <= 1.0).all(axis=1)
    waypoints = JointWaypoints(tuple("abc"[:d]), [0, h], y, v)
    if feasible.any():
        trajectory = plan("parabolic-blend", waypoints, acceleration_limit=limit)
        assert trajectory.breaks[1] <= times[np.argmax(feasible), 0] * (1 + 1e-9)
        assert (trajectory.extrema("acceleration").peak <= limit * (1 + 1e-9)).all()
    else:
        with pytest.raises(InputError, match=r"acceleration_limit .* is too low"):
            plan("parabolic-blend", waypoints, acceleration_limit=limit)
