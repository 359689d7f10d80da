"""Chosen speeds along tool paths, and numbers that a refusal names: with them it is planned."""

from __future__ import annotations

import re
from itertools import count
from typing import Any

import numpy as np
import pytest
from reaching import reach

import knotwork as kw
from knotwork.errors import InputError, PathError
from knotwork.planning.choosing import chosen_values, solved_scenario
from knotwork.planning.task_to_joint import solve_task
from knotwork.planning.timing.budget import Budget
from knotwork.task.scenario.scenario_joints import read_scenario_joints
from plans import passing_plan
from sweeps import mostly_exhaustive

LIMITS = {"velocity": 60, "acceleration": 800}


def line(
    name: str, y: float, speed: Any = "fastest", *, turn: float | None = None, **keys: Any
) -> dict[str, Any]:
    """A stretch to some y [mm], on which the tool turns about itself [deg]."""
    pose: dict[str, Any] = {"position": [400, y, 300]}
    if turn is not None:
        pose["rpy"] = [180, 0, turn]
    given = {} if "after" in keys else {"speed": speed}
    return {"name": name, "along": "line", "pose": pose, **given, **keys}


def speeds(plan: kw.Plan) -> list[float]:
    """Of all stretches [mm/s]."""
    return [1e3 * one.speed for path in plan.scenario.paths for one in path.stretches]


def keeps(task: dict[str, Any], given: list[float]) -> bool:
    """Whether a task passes its check where all stretches are given speeds [mm/s]."""
    first, *ends = task["waypoints"]
    stretches = [end | {"speed": speed} for end, speed in zip(ends, given, strict=True)]
    try:
        return kw.plan({**task, "waypoints": [first, *stretches]}).report.ok
    except InputError:
        return False


def test_each_stretch_has_its_maximum_speed() -> None:
    """Between two straight stretches the wrist has to turn."""
    ends = [line("a", -50), line("b", 50, turn=-90), line("c", 250)]
    task = reach(*ends, limits={"velocity": 60, "acceleration": 1600})
    plan = passing_plan(task)
    found = speeds(plan)
    assert min(found[0], found[2]) > 2.5 * found[1]
    for k in range(3):
        faster = [1.06 * speed if j == k else speed for j, speed in enumerate(found)]
        assert not keeps(task, faster)


def test_limited_stretch_does_not_slow_next_path() -> None:
    task = reach(
        line("a", 0, {"at_most": 100}, stop=True),
        line("b", 100),
        line("c", 200, {"at_most": 60}),
        limits={"acceleration": 400},
    )
    plan = passing_plan(task)
    assert speeds(plan)[0] == pytest.approx(100)
    assert speeds(plan)[1] > 200
    assert speeds(plan)[2] == pytest.approx(60)


def test_equal_stretches_share_speed_under_jerk_limit() -> None:
    limits = {"velocity": 60, "acceleration": 600, "jerk": 6000}
    task = reach(line("a", 0), line("b", 200), limits=limits, tolerances={"path": 0.2})
    first, second = speeds(passing_plan(task))
    assert first == second > 300


def test_short_given_stretch_between_chosen_ones() -> None:
    """The neighbours are too short to slow down, and the limits do not require it."""
    task = reach(line("a", -100), line("b", -60, 300), line("c", 200), limits={"acceleration": 800})
    plan = passing_plan(task)
    assert min(speeds(plan)) == 300


@pytest.mark.parametrize(
    ("length", "acceleration"),
    mostly_exhaustive([(0.1, 10), (0.1, 1), (0.01, 10), (0.01, 100), (1, 1)], (0.1, 10)),
)
def test_plans_slow_speed_of_short_line(length: float, acceleration: float) -> None:
    """Less than 1 mm/s, from rest to rest."""
    bounds = {"limits": {"acceleration": 800}, "path": {"acceleration": acceleration}}
    task = reach(line("a", length - 200), **bounds)
    (speed,) = speeds(kw.plan(task))
    assert speed == pytest.approx((2 / 3 * length * acceleration) ** 0.5, rel=1e-3)
    assert speed < 1.0


def test_progress_of_speeds_alone() -> None:
    """Speeds along paths are no sections of the solver, so there is nothing to count."""
    seen: list[float] = []
    kw.plan(reach(line("a", 0), limits=LIMITS), progress=lambda now: seen.append(now.fraction))
    assert seen == [1.0]


def test_bound_below_least_speed_holds() -> None:
    bounds = {"limits": {"acceleration": 800}, "path": {"acceleration": 10}}
    plan = passing_plan(reach(line("a", -199, {"at_most": 0.5}), **bounds))
    assert speeds(plan) == [pytest.approx(0.5)]


def test_speed_that_is_proposed_for_a_short_stretch_is_feasible() -> None:
    """The wrist has to turn slowly, and there is no room to come down to that from 200 mm/s."""
    stretches = line("a", -160), line("b", 0, turn=-120)
    limits = {"velocity": 60, "acceleration": 8000, "jerk": 1e6}
    passing_plan(reach(*stretches, limits=limits))


@pytest.mark.parametrize(
    ("timed", "free"), mostly_exhaustive([(False, True), (True, False)], (True, False))
)
def test_refuses_given_speed_beyond_joint_limits(timed: bool, free: bool) -> None:
    """Be it given by a time, and whether the speed of the next stretch is chosen or not."""
    first = line("a", -50, **{"after" if timed else "speed": 2.2 if timed else 100})
    last = line("c", 250, "fastest" if free else 30)
    ends = [first, line("b", 50, 30, turn=-90), last, {"joints": "home"}]
    limits = {"velocity": 60, "acceleration": 100}
    task = reach(*ends, limits=limits, times="fastest", path={"acceleration": 150})
    says = r"waypoints\[1\]\.{} at .* mm/s along the path from 'in' to 'a': .*speed: fastest"
    key = "after:" if timed else "speed:"
    with pytest.raises(InputError, match=says.format(key)):
        kw.plan(task)
    first.pop("after", None)
    kw.plan(task | {"waypoints": [task["waypoints"][0], first | {"speed": "fastest"}, *ends[1:]]})


HURRIED = {"acceleration": 600, "jerk": 8000}


def passed(*ends: dict[str, Any], limits: dict[str, Any]) -> dict[str, Any]:
    """A path that is passed without a stop, where the arm is folded more and jerk binds more."""
    task = reach(*ends, {"name": "up", "pose": {"position": [520, 0, 300]}}, limits=limits)
    for waypoint in task["waypoints"][:-1]:
        waypoint["pose"]["position"][0::2] = [420, 200]
    task["waypoints"][-1]["pose"]["rpy"] = [180, 0, 0]
    return task | {"start": "home", "times": "fastest"}


def test_short_stretch_takes_neighbour_speed_under_jerk_limit() -> None:
    """The maximum speed that one cap allows."""
    ends = [line("a", -30), line("b", -28), line("c", 70, {"at_most": 20})]
    task = passed(*ends, limits=HURRIED)
    plan = passing_plan(task)
    assert speeds(plan)[1:] == [20, 20]
    assert speeds(plan)[0] > 100
    (finding,) = plan.report.select(quantity="lower_bound")
    assert str(finding).endswith(
        f"is shorter than {finding.value:.6g} s with these speeds along its paths"
    )


def test_takes_speed_of_given_neighbours() -> None:
    ends = [line("a", -195), line("b", -167, 10), line("c", -161)]
    task = passed(*ends, limits={"acceleration": 1500, "jerk": 4000})
    plan = passing_plan(task | {"tolerances": {"path": 0.3, "path_speed": 0.03}})
    assert min(speeds(plan)) == 10


def test_slows_path_that_cannot_be_left_at_maximum_speed() -> None:
    """A wrist joint is at its limit of velocity where the path ends, and has to turn back."""
    ends = [line("a", -117.9), line("b", -31.5)]
    task = passed(*ends, limits={"acceleration": 600, "jerk": 4000})
    task["waypoints"][0]["pose"]["position"][1] = -120
    plan = passing_plan(task)
    texts = [str(one) for one in plan.report.select(quantity="active_limits")]
    assert any("its speed is limited by the motion before or after" in one for one in texts)
    for end in ends:
        end["speed"] = 0.5 * speeds(plan)[-1]
    slower = kw.plan(task)
    assert slower.chosen_values.duration > plan.chosen_values.duration


def test_takes_first_speeds_with_motions_when_budget_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lower ones would give a shorter motion, but need more time."""
    task = passed(line("a", -117.9), line("b", -31.5), limits={"acceleration": 600, "jerk": 4000})
    task["waypoints"][0]["pose"]["position"][1] = -120
    choose = chosen_values.maximum_path_speeds
    tried: list[list[float]] = []

    def record(*given: Any) -> Any:
        found = choose(*given)
        tried.append([speed for problem in found.problems for speed, _ in problem.speeds.values()])
        return found

    monkeypatch.setattr(chosen_values, "maximum_path_speeds", record)
    plan = passing_plan(task, budget=1e-3)
    assert plan.chosen_values.status == "budget"
    assert len(tried) == 2  # the maximum speeds have no motions
    assert speeds(plan) == pytest.approx(1e3 * np.array(tried[-1]))


def test_tolerance_bounds_speed_if_path_cannot_be_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first motion along the path can't be made, so that lower speeds are tried."""
    solve, calls = solved_scenario.solve_task, count()

    def fail_at_first_speeds(*given: Any) -> Any:
        if next(calls) == 0:
            raise PathError("the steps would be too small")
        return solve(*given)

    monkeypatch.setattr(solved_scenario, "solve_task", fail_at_first_speeds)
    plan = passing_plan(reach(line("a", 100), limits=LIMITS))
    (finding,) = plan.report.select(quantity="active_limits")
    assert "its speed is limited by the tolerance of the path" in str(finding)


def test_path_that_cannot_be_followed_slows_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    task = reach(line("a", 100, stop=True), line("b", -100), limits=LIMITS)
    scenario = kw.load_scenario(task)
    fastest = speeds(kw.plan(scenario))
    solve, calls = solved_scenario.solve_task, count()

    def fail_on_second_path(*given: Any) -> Any:
        if next(calls) == 0:
            start = scenario.paths[1].first
            raise PathError("the steps would be too small", path_start=start)
        return solve(*given)

    monkeypatch.setattr(solved_scenario, "solve_task", fail_on_second_path)
    first, second = speeds(kw.plan(scenario))
    assert first == pytest.approx(fastest[0])
    assert 0.75 * fastest[1] < second < 0.85 * fastest[1]


def test_speeds_are_expected_for_the_given_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = kw.load_scenario(reach(line("a", 100), limits=LIMITS))
    joints = read_scenario_joints(scenario)
    best = solve_task(scenario, joints)
    other = solve_task(scenario, joints, blocked_steps=[(0, best.sequence[0], best.sequence[1])])
    starts: list[Any] = []
    solve = solved_scenario.solve_task

    def record(*given: Any) -> Any:
        starts.append(solve(*given).waypoints.position[0])
        return solve(*given)

    monkeypatch.setattr(solved_scenario, "solve_task", record)
    solved = solved_scenario.SolvedScenario(scenario, joints, other, scenario)
    chosen_values.choose_values(solved, Budget())
    assert not np.allclose(other.waypoints.position[0], best.waypoints.position[0])
    assert np.allclose(starts, other.waypoints.position[0])


JOINT_LIMITS = {"velocity": 1, "acceleration": 2, "jerk": 20}


def task(*waypoints: dict[str, Any], **keys: Any) -> dict[str, Any]:
    start = {"name": "a", "joints": {"q": 0}}
    return {"times": "fastest", "limits": JOINT_LIMITS, "waypoints": [start, *waypoints], **keys}


def refusal(of: dict[str, Any]) -> str:
    with pytest.raises(InputError) as raised:
        kw.plan(of)
    return str(raised.value)


def number(text: str, before: str) -> float:
    found = re.search(before + r" ([0-9.]+) s", text)
    assert found, text
    return float(found[1])


def test_named_duration_is_feasible() -> None:
    end = {"name": "b", "joints": {"q": 1}}
    named = number(refusal(task(end, duration=0.5)), "accepted:")
    plan = kw.plan(task(end, duration=named))
    assert plan.trajectory.duration == pytest.approx(named)
    assert named < 1.002 * kw.plan(task(end)).trajectory.duration


def test_names_time_bounded_by_tool_speed() -> None:
    turned = {"name": "b", "joints": {"shoulder": 1.5, "elbow": 1.2}, "after": 1.2}
    across = {
        "robot": "planar2",
        "start": "home",
        "knots": "optimal",
        "limits": {"tool_speed": 0.5},
        "waypoints": [turned],
    }
    text = refusal(across)
    assert "the tool, on the straight line, takes more than" in text
    turned["after"] = number(text, ";")
    passing_plan(across)


def test_a_given_time_may_follow_a_path_with_a_chosen_speed() -> None:
    end = {"name": "up", "pose": {"position": [400, 100, 400], "rpy": [180, 0, 0]}, "time": 9}
    plan = passing_plan(reach(line("a", 100, stop=True), end, limits=LIMITS))
    assert plan.trajectory.duration == pytest.approx(9)
    assert speeds(plan)[0] > 50
