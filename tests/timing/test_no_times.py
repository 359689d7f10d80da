"""Problems without a solution: each error names the place, the limit and what is sufficient."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from timing_cases import assert_kept, random_problem

import knotwork as kw
from knotwork.errors import InputError, TimingError
from knotwork.joint_quantities import JointLimits
from knotwork.planning.timing import Objective, TimingProblem, solve
from knotwork.units import Units

LIMITS = JointLimits([2.0], [1.0], [100.0])


def one_joint(
    position: Any, velocity: Any, limits: JointLimits = LIMITS, **given: Any
) -> TimingProblem:
    column = [np.reshape(x, (-1, 1)) for x in (position, velocity)]
    return TimingProblem(("elbow",), *column, limits, names=tuple("abcd"[: len(position)]), **given)


def failure(problem: TimingProblem, **options: Any) -> TimingError:
    with pytest.raises(TimingError) as raised:
        solve(problem, **options)
    return raised.value


TOO_FAST = [0, 1, 0], [0, 4, 0]
REST = [0, 1, 0], [0, 0, 0]
NARROW = replace(LIMITS, lower=[-1.0], upper=[0.5])


@pytest.mark.parametrize(
    ("problem", "place", "values", "message"),
    [
        (one_joint(*TOO_FAST), (1, "velocity"), (4.0, 2.0), "'b': joint 'elbow'.*0.5 times"),
        (
            one_joint(*TOO_FAST, units=Units("m", "deg")),
            (1, "velocity"),
            (4.0, 2.0),
            "229.183 deg/s; its limit is 114.592 deg/s",
        ),
        (
            one_joint(*TOO_FAST, replace(LIMITS, used_fraction=0.5)),
            (1, "velocity"),
            (4.0, 2.0),
            r"its limit is 2 rad/s, 0.5 of 4 rad/s \(used_fraction\)",
        ),
        (one_joint([0, 1], [0, 0], NARROW), (1, "position"), (1.0, 0.5), "outside its limits"),
        (
            one_joint(*REST, total=3.0, objective=Objective(time=0.0, jerk=1.0)),
            (None, "duration"),
            (3.0, 4.0),
            "takes more than 4 s",
        ),
        (one_joint(*REST, JointLimits([1.0])), (None, "acceleration"), (None, None), "'elbow'"),
        (one_joint([0, 0, 1], [0, 0, 0]), (0, "duration"), (None, None), "no joint moves"),
    ],
)
def test_names_infeasible_values(
    problem: TimingProblem, place: tuple[Any, str], values: tuple[Any, Any], message: str
) -> None:
    error = failure(problem)
    assert (error.waypoint_index, error.cause) == place
    assert (error.value, error.feasible_value) == pytest.approx(values)
    assert re.search(message, str(error))


@pytest.mark.parametrize(
    ("problem", "given", "place", "least", "message"),
    [
        (
            lambda a: one_joint([0, 1], [0, 0], acceleration=[[a], [np.nan]]),
            3.0,
            (0, False, "acceleration"),
            0.99,
            "At most",
        ),
        (
            lambda v: one_joint([0, 1, 0], [0, v, 0], replace(LIMITS, lower=[-1.0], upper=[1.2])),
            1.0,
            (1, False, "position"),
            0.999 * np.sqrt(0.4),  # which leaves the jerk no room
            "needs at least 0.5 rad",
        ),
        (
            lambda h: one_joint(*REST, duration=[np.nan, h]),
            1.0,
            (1, True, "duration"),
            2.0,  # bang-bang is 2 sqrt(1 / 1)
            "takes more than 2 s",
        ),
        (
            lambda h: one_joint([0, 1], [0, 0], replace(LIMITS, jerk=[1.0]), duration=[h]),
            2.1,
            (0, True, "duration"),
            3.17,  # to rest, for the jerk
            "is enough for a motion that stops at both ends",
        ),
        (
            lambda total: one_joint(
                *REST, replace(LIMITS, jerk=[1.0]), total=total, objective=Objective(0.0, 1.0)
            ),
            4.2,
            (None, False, "duration"),
            2 * 3.17,
            "is enough for a motion that stops at each waypoint",
        ),
    ],
)
def test_names_nearest_feasible_value(
    problem: Callable[[float], TimingProblem],
    given: float,
    place: tuple[int | None, bool, str],
    least: float,
    message: str,
) -> None:
    error = failure(problem(given))
    assert (error.waypoint_index, error.in_interval, error.cause) == place
    assert least < error.feasible_value < 1.02 * least
    assert message in str(error)
    solve(problem(0.98 * error.feasible_value if place[2] == "position" else error.feasible_value))


def test_reports_all_infeasible_waypoints_at_once() -> None:
    error = failure(one_joint([0, 1, 2, 0], [0, 4, 3, 0]))
    first, second = str(error).splitlines()
    assert "waypoint 'b'" in first
    assert "0.5 times" in first
    assert "waypoint 'c'" in second
    assert "0.6666 times" in second
    solve(one_joint([0, 1, 2, 0], [0, 2, 2, 0]))


def test_reports_duration_beyond_gap_of_feasible_ones() -> None:
    """At these velocities the joint arrives early, or it stops and goes back."""
    limits = JointLimits([2.0], [0.1], [100.0])
    error = failure(one_joint([0, 1], [1, 1], limits, duration=[20.0]))
    assert error.feasible_value > 38.98
    for possible in (0.98, error.feasible_value):
        solve(one_joint([0, 1], [1, 1], limits, duration=[possible]))


def test_reports_ended_budget() -> None:
    problem = random_problem(1, 8, 5)
    duration = np.full(7, np.nan)
    duration[2] = np.diff(solve(problem).time)[2]
    error = failure(replace(problem, duration=duration), budget=1e-6)
    assert "within the budget of 1e-06 s; accepted: a larger budget" in str(error)


@pytest.mark.parametrize("seed", range(8))
def test_resting_motion_with_given_velocities_needs_no_budget(seed: int) -> None:
    """It comes to rest between the waypoints."""
    rng = np.random.default_rng(seed)
    problem = random_problem(seed, 2 + seed % 9, 1 + seed % 6)
    limits = problem.limits
    acceleration = np.full(problem.position.shape, np.nan)
    acceleration[[0, -1]] = 0.1 * rng.uniform(-1.0, 1.0, (2, 1)) * limits.acceleration
    min_duration = np.zeros(len(problem.position) - 1)
    min_duration[::2] = 3.0
    problem = replace(problem, acceleration=acceleration, min_duration=min_duration)
    motion = solve(problem, budget=1e-6)
    assert motion.status == "budget"
    assert_kept(problem, replace(motion, status="optimal"))
    ends = motion.trajectory.acceleration(motion.time[[0, -1]])
    np.testing.assert_allclose(ends, acceleration[[0, -1]], atol=1e-12)
    assert solve(problem).duration <= motion.duration * (1 + 1e-12)


def test_resting_motion_takes_rounding_of_velocity_as_rest() -> None:
    problem = one_joint([0, 1, 2], [0, 1e-17, 0])
    motion = solve(problem, budget=1e-6)
    assert motion.status == "budget"
    assert_kept(problem, replace(motion, status="optimal"))


@pytest.mark.parametrize("given", [5e3, 1e5])
def test_time_next_to_a_far_longer_one_is_least(given: float) -> None:
    problem = one_joint([0, 1, 2], [0, 0, 0], duration=[given, np.nan])
    assert solve(problem).duration - given < 2.02  # bang-bang is 2 s


def test_effort_needs_dynamics() -> None:
    with pytest.raises(InputError, match="need dynamics"):
        one_joint([0, 1], [0, 0], JointLimits([1.0], [1.0], effort=[1.0]))


def test_reports_short_times_together() -> None:
    first, second = str(failure(one_joint([0, 1, 3], np.zeros(3), duration=[1.0, 1.5]))).split("\n")
    assert re.match("from 'a' to 'b' 1 s are given; .* joint 'elbow' takes more than 2 s", first)
    assert re.match("from 'b' to 'c' 1.5 s are given; .* takes more than 2.82843 s", second)


def test_reports_overloaded_static_hold() -> None:
    def planned(effort: float) -> kw.Plan:
        ends = [
            {"name": name, "joints": {"shoulder": q, "elbow": q}}
            for name, q in [("flat", 0.0), ("up", 0.5)]
        ]
        limits = {"effort": effort, "acceleration": 10}
        gravity = {"gravity": [0, -9.81, 0], "times": "fastest"}
        return kw.plan({"robot": "planar2", "limits": limits, "waypoints": ends, **gravity})

    # none was searched for
    message = "no motion keeps all limits: to hold the arm still at 'flat', joint 'shoulder' needs"
    with pytest.raises(TimingError, match=message) as heavy:
        planned(5.0)
    assert heavy.value.cause == "effort"
    robot = kw.load_robot("planar2")
    robot.model.gravity.linear = np.array([0.0, -9.81, 0.0])
    held = pin.rnea(robot.model, robot.model.createData(), *np.zeros((3, 2)))
    assert heavy.value.feasible_value == pytest.approx(held[0])
    assert planned(1.5 * heavy.value.feasible_value).report.ok


def over_the_top(effort: float, **more: Any) -> kw.Plan:
    """Past a place where the arm is stretched out, too heavy to rest there below some 21 N m."""
    places = [("in", -1.5), ("over", 0.0), ("out", 1.5)]
    points: list[dict[str, Any]] = [
        {"name": name, "joints": {"shoulder": q, "elbow": 0}} for name, q in places
    ]
    points[1]["velocity"] = "free"
    limits = {"effort": effort, "velocity": 6}
    gravity = {"gravity": [0, -9.81, 0], "times": "fastest"}
    given = {"limits": limits, "waypoints": points, **gravity, **more}
    return kw.plan({"robot": "planar2", **given})


def test_passes_overloaded_waypoint_in_motion() -> None:
    plan = over_the_top(12.0)
    plan.report.raise_if_failed()
    assert abs(plan.chosen_values.sections[0].velocity[1, 0]) > 0.5


def test_reports_overloaded_passage_with_sufficient_effort() -> None:
    with pytest.raises(
        TimingError, match="to hold the arm still at 'over', joint 'shoulder' needs"
    ) as heavy:
        over_the_top(4.0)
    error = heavy.value
    assert (error.waypoint_index, error.joint, error.cause) == (1, "shoulder", "effort")
    assert "waypoints[1]: " in str(error)
    assert "it is 4 N m" in str(error)
    over_the_top(error.feasible_value).report.raise_if_failed()
