"""Problems without a solution: each error names the place, the limit and what would do."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from timing_cases import assert_kept, random_problem

import knotwork as kw
from knotwork.errors import InputError, TimingError
from knotwork.timing import Objective, TimingLimits, TimingProblem, solve, solving
from knotwork.timing.budget import Watch
from knotwork.timing.infeasible import impossible
from knotwork.units import Units

LIMITS = TimingLimits([2.0], [1.0], [100.0])


def one_joint(
    position: Any, velocity: Any, limits: TimingLimits = LIMITS, **given: Any
) -> TimingProblem:
    column = [np.reshape(x, (-1, 1)) for x in (position, velocity)]
    return TimingProblem(("elbow",), *column, limits, names=tuple("abcd"[: len(position)]), **given)


def failure(problem: TimingProblem, **options: Any) -> TimingError:
    with pytest.raises(TimingError) as raised:
        solve(problem, **options)
    return raised.value


def test_a_velocity_above_its_limit() -> None:
    error = failure(one_joint([0, 1, 0], [0, 4, 0]))
    assert (error.waypoint, error.joint, error.limit) == (1, "elbow", "velocity")
    assert (error.value, error.bound) == (4.0, 2.0)
    assert "'b'" in str(error)
    assert "0.5 times" in str(error)
    shown = failure(one_joint([0, 1, 0], [0, 4, 0], units=Units("m", "deg")))
    assert "229.183 deg/s; its limit is 114.592 deg/s" in str(shown)
    assert (shown.value, shown.bound) == (4.0, 2.0)


def test_an_acceleration_above_its_limit() -> None:
    error = failure(one_joint([0, 1], [0, 0], acceleration=[[3.0], [np.nan]]))
    assert (error.waypoint, error.limit) == (0, "acceleration")
    assert 0.99 < error.bound <= 1.0
    solve(one_joint([0, 1], [0, 0], acceleration=[[error.bound], [np.nan]]))


def test_a_waypoint_outside_the_position_limits() -> None:
    limits = replace(LIMITS, lower=[-1.0], upper=[0.5])
    error = failure(one_joint([0, 1], [0, 0], limits))
    assert (error.waypoint, error.limit, error.bound) == (1, "position", 0.5)


def test_a_speed_that_cannot_be_stopped_before_the_limit() -> None:
    limits = replace(LIMITS, lower=[-1.0], upper=[1.2])
    error = failure(one_joint([0, 1, 0], [0, 1, 0], limits))
    assert (error.waypoint, error.limit) == (1, "position")
    assert error.bound == pytest.approx(np.sqrt(0.4))
    assert "needs at least 0.5 rad" in str(error)
    solve(one_joint([0, 1, 0], [0, 0.98 * error.bound, 0], limits))


def test_all_waypoints_beyond_limits_are_told_at_once() -> None:
    error = failure(one_joint([0, 1, 2, 0], [0, 4, 3, 0]))
    first, second = str(error).splitlines()
    assert "waypoint 'b'" in first
    assert "0.5 times" in first
    assert "waypoint 'c'" in second
    assert "0.6666 times" in second
    solve(one_joint([0, 1, 2, 0], [0, 2, 2, 0]))


def test_a_margin_is_said_and_proposed_limits_are_before_it() -> None:
    error = failure(one_joint([0, 1, 0], [0, 4, 0], replace(LIMITS, margin=0.5)))
    assert "its limit is 2 rad/s, 0.5 of 4 rad/s (margin)" in str(error)
    limits = TimingLimits([2.0], [17.5], [42.0], lower=[-0.08], upper=[1.082], margin=0.5)
    ends = [[0.0], [0.0], [0.0]]
    error = failure(one_joint([0, 1.047, 1.065], [0, 0.96, 0], limits, acceleration=ends))
    assert (error.joint, error.limit, error.value) == ("elbow", "position", 1.082)


def test_a_given_time_that_is_too_short() -> None:
    error = failure(one_joint([0, 1, 0], [0, 0, 0], duration=[np.nan, 1.0]))
    assert (error.waypoint, error.interval, error.limit) == (1, True, "duration")
    assert error.bound is not None
    assert "takes more than 2 s" in str(error)  # bang-bang is 2 sqrt(1 / 1)
    solve(one_joint([0, 1, 0], [0, 0, 0], duration=[np.nan, error.bound]))


def test_a_time_that_only_the_jerk_makes_too_short() -> None:
    limits = replace(LIMITS, jerk=[4.0])
    free = solve(one_joint([0, 1], [0, 0], limits))
    error = failure(one_joint([0, 1], [0, 0], limits, duration=[0.99 * free.duration]))
    assert error.limit == "duration"
    assert error.bound is not None
    assert error.bound > free.duration
    solve(one_joint([0, 1], [0, 0], limits, duration=[error.bound]))


def test_a_time_between_passing_and_going_back() -> None:
    limits = TimingLimits([2.0], [0.1], [100.0])
    error = failure(one_joint([0, 1], [1, 1], limits, duration=[20.0]))
    longest, shortest = re.findall(r"(?:less|more) than ([0-9.]+) s", str(error))
    assert float(shortest) == pytest.approx(38.98, abs=0.01)
    for possible in (0.98 * float(longest), 1.02 * float(shortest), error.bound):
        solve(one_joint([0, 1], [1, 1], limits, duration=[possible]))


def test_a_total_that_is_too_short() -> None:
    smooth = Objective(time=0.0, jerk=1.0)
    error = failure(one_joint([0, 1, 0], [0, 0, 0], total=3.0, objective=smooth))
    assert (error.limit, error.value) == ("duration", 3.0)
    assert error.bound == pytest.approx(4.0)


def test_no_limit_that_gives_a_least_time() -> None:
    error = failure(one_joint([0, 1], [0, 0], TimingLimits([1.0])))
    assert error.joint == "elbow"


def test_an_interval_in_which_nothing_moves() -> None:
    error = failure(one_joint([0, 0, 1], [0, 0, 0]))
    assert (error.waypoint, error.interval, error.limit) == (0, True, "duration")
    solve(one_joint([0, 0, 1], [0, 0, 0], at_least=[0.2, 0.0]))


def test_contradictory_limits() -> None:
    """Nothing given is beyond a limit, but braking within the jerk limit takes too far."""
    limits = TimingLimits([2.0], [1.0], [0.7], lower=[-9.0], upper=[1.55])
    error = failure(
        one_joint([0, 1, 0], [0, 1, 0], limits, acceleration=[[np.nan], [0.0], [np.nan]])
    )
    assert error.joint == "elbow"
    assert error.limit in ("jerk", "acceleration", "velocity", "position")
    assert error.bound is not None


def test_a_budget_that_is_too_small_is_no_answer() -> None:
    problem = random_problem(1, 8, 5)
    duration = np.full(7, np.nan)
    duration[3] = solve(problem).time[4] - solve(problem).time[3]
    error = failure(replace(problem, duration=duration), budget=1e-6)
    assert "within the budget of 1e-06 s; allow more time" in str(error)


def test_a_motion_that_stops_needs_no_time_to_be_found() -> None:
    problem = random_problem(1, 8, 5)
    velocity = np.array(problem.velocity)
    velocity[1:-1] = np.nan
    free = replace(problem, velocity=velocity, at_least=np.full(7, 0.2))
    motion = solve(free, budget=1e-6)
    assert motion.status == "stopped"
    assert_kept(free, replace(motion, status="optimal"))
    assert (motion.velocity == 0.0).all()


@pytest.mark.parametrize("seed", range(20))
def test_a_motion_past_given_velocities_needs_no_time_to_be_found(seed: int) -> None:
    """It comes to rest between the waypoints."""
    rng = np.random.default_rng(seed)
    problem = random_problem(seed, 2 + seed % 9, 1 + seed % 6)
    limits = problem.limits
    acceleration = np.full(problem.position.shape, np.nan)
    acceleration[[0, -1]] = 0.1 * rng.uniform(-1.0, 1.0, (2, 1)) * limits.acceleration
    at_least = np.zeros(len(problem.position) - 1)
    at_least[::2] = 3.0
    asked = replace(problem, acceleration=acceleration, at_least=at_least)
    motion = solve(asked, budget=1e-6)
    assert motion.status == "stopped"
    assert_kept(asked, replace(motion, status="optimal"))
    np.testing.assert_allclose(motion.acceleration[[0, -1]], acceleration[[0, -1]], atol=1e-12)
    assert solve(asked).duration <= motion.duration * (1 + 1e-12)


def test_a_joint_that_rests_has_no_limit_of_acceleration() -> None:
    limits = TimingLimits([1.0, 1.0], [np.inf, np.inf], [100.0, 100.0])
    still = np.zeros((2, 2))
    problem = TimingProblem(("a", "b"), [[0.0, 0.0], [1.0, 0.0]], still, limits)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert solve(problem, budget=1e-6).status == "stopped"


@pytest.mark.parametrize(
    ("seed", "longer", "mixed"), [(2, (125, 150), True), (5, (125, 150), False)]
)
def test_a_longer_budget_never_ends_with_more_than_stops_take(
    monkeypatch: pytest.MonkeyPatch, seed: int, longer: tuple[int, ...], mixed: bool
) -> None:
    """Parts that stop beside parts that were searched for, by a clock of steps."""
    problem = random_problem(seed, 33, 3)
    velocity = np.array(problem.velocity)
    velocity[1:-1] = np.nan
    free = replace(problem, velocity=velocity)
    monkeypatch.setattr(solving, "Watch", lambda *given: Watch(*given, now=count().__next__))
    stops, *found = (solve(free, budget=budget) for budget in (5, *longer))
    assert (stops.velocity == 0.0).all()
    for motion in found:
        assert motion.status == "stopped"
        assert_kept(free, replace(motion, status="optimal"))
        assert motion.duration <= stops.duration
    at_rest = (found[0].velocity == 0.0).all(axis=1)[1:-1]
    assert (0 < at_rest.sum() < at_rest.size) == mixed


def test_effort_needs_dynamics() -> None:
    with pytest.raises(InputError, match="need dynamics"):
        one_joint([0, 1], [0, 0], TimingLimits([1.0], [1.0], effort=[1.0]))


def test_a_proposed_time_suits_the_intervals_beside() -> None:
    """Alone the first interval takes less, with an acceleration that the next can't begin with."""
    limits = TimingLimits([2.0944] * 2, [4.18879] * 2, [41.8879] * 2)
    position = [[0.0, 0.0], [1.0472, -0.5236], [2.0944, 0.0]]
    velocity = [[0.0, 0.0], [1.74533, 0.0], [0.0, 0.0]]
    ends = [[0.0] * 2, [np.nan] * 2, [0.0] * 2]
    given = {"acceleration": ends, "duration": [0.76, np.nan]}
    problem = TimingProblem(("a", "b"), position, velocity, limits, **given)
    solve(replace(problem, duration=[failure(problem).bound, np.nan]))


@pytest.mark.exhaustive
def test_faults_in_different_intervals_are_told_together() -> None:
    """Each is alone: velocities and accelerations are given between them."""
    error = failure(
        one_joint(
            [0, 1, 2, 3],
            np.zeros(4),
            replace(LIMITS, jerk=[1.0]),
            acceleration=np.zeros((4, 1)),
            duration=[2.5, np.nan, 2.6],
        )
    )
    first, second = str(error).splitlines()
    assert "from 'a' to 'b' 2.5 s are given" in first
    assert "from 'c' to 'd' 2.6 s are given" in second


def test_a_joint_that_takes_too_long_is_named() -> None:
    asked = one_joint([0, 1, 3], np.zeros(3), duration=[1.0, 1.5])
    first, second = map(str, impossible(asked))
    assert "joint 'elbow' takes more than 2 s" in first
    assert "joint 'elbow' takes more than 2.82843 s" in second


def test_an_arm_too_heavy_to_hold_still_names_waypoint_joint_and_limit() -> None:
    def planned(effort: float) -> kw.Plan:
        ends = [
            {"name": name, "joints": {"shoulder": q, "elbow": q}}
            for name, q in [("flat", 0.0), ("up", 0.5)]
        ]
        limits = {"effort": effort, "acceleration": 10}
        gravity = {"gravity": [0, -9.81, 0], "times": "fastest"}
        return kw.plan({"robot": "planar2", "limits": limits, "waypoints": ends, **gravity})

    said = "no motion keeps all limits: at 'flat' joint 'shoulder' needs"  # none was searched for
    with pytest.raises(TimingError, match=said) as heavy:
        planned(5.0)
    assert heavy.value.limit == "effort"
    robot = kw.load_robot("planar2")
    robot.model.gravity.linear = np.array([0.0, -9.81, 0.0])
    held = pin.rnea(robot.model, robot.model.createData(), *np.zeros((3, 2)))
    assert heavy.value.bound == pytest.approx(held[0])
    assert planned(1.5 * heavy.value.bound).report.ok


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


def test_a_place_where_the_arm_is_too_heavy_to_rest_is_passed_in_motion() -> None:
    made = over_the_top(12.0)
    made.report.raise_if_failed()
    assert made.chosen is not None
    assert abs(made.chosen.segments[0].velocity[1, 0]) > 0.5


@pytest.mark.parametrize(("effort", "longer"), [(12.0, 1.02), (19.0, 1.001)])
def test_such_a_place_is_passed_in_a_little_more_than_the_least_time(
    effort: float, longer: float
) -> None:
    least = over_the_top(effort).trajectory.duration
    made = over_the_top(effort, duration=longer * least)
    made.report.raise_if_failed()
    assert made.trajectory.duration == pytest.approx(longer * least)
    assert made.chosen is not None
    assert made.chosen.status == "optimal"


def test_an_arm_too_heavy_to_rest_where_its_velocity_is_free_is_told_with_what_suffices() -> None:
    with pytest.raises(TimingError, match="to rest at 'over' joint 'shoulder' needs a") as heavy:
        over_the_top(4.0)
    error = heavy.value
    assert (error.waypoint, error.joint, error.limit) == (1, "shoulder", "effort")
    assert "waypoints[1]: " in str(error)
    assert "it is 4 N m" in str(error)
    over_the_top(error.bound).report.raise_if_failed()
