"""Free times of arms: poses, tool paths, torques, scenarios frozen, and the commands."""

from __future__ import annotations

import json
import math
import time
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest
from reaching import reach

import knotwork as kw
from command_line import Command
from knotwork.errors import InputError
from plans import passing_plan, planned
from sweeps import first_of


def test_the_payload_bounds_the_times_by_torque() -> None:
    plan = planned("ur5_palletise")
    assert any(one.quantity == "effort" for one in plan.chosen_values.active_limits)
    document = plan.chosen_values.original_scenario.task.to_dict()
    light = {**document, "tool": {"frame": "tool0", "offset": document["tool"]["offset"]}}
    assert kw.plan(light).trajectory.duration < plan.trajectory.duration


def line(speed: Any, y: float = 200) -> dict[str, Any]:
    return {"name": "out", "along": "line", "speed": speed, "pose": {"position": [400, y, 300]}}


def active_limits(plan: kw.Plan) -> list[str]:
    return [str(finding) for finding in plan.report.select(quantity="active_limits")]


def passes(task: dict[str, Any]) -> bool:
    try:
        return kw.plan(task).report.ok
    except InputError:
        return False


def test_maximum_speed_along_path() -> None:
    """From rest to rest: the acceleration along the path bounds it, here by 516.398 mm/s."""
    plan = passing_plan(reach(line("fastest"), times="fastest"))
    (path,) = plan.scenario.paths
    assert path.stretches[0].speed == pytest.approx(0.5164, rel=2e-3)
    assert active_limits(plan) == [
        "in to out: its speed is limited by path.acceleration, 1000 mm/s²"
    ]
    slow = {"velocity": 60, "acceleration": 400}
    held = passing_plan(reach(line("fastest"), limits=slow))
    (finding,) = active_limits(held)
    assert "its speed is limited by velocity of '" in finding
    speed = 1e3 * held.scenario.paths[0].stretches[0].speed
    assert 300 < speed < 516
    assert not passes(reach(line(1.01 * speed), limits=slow))


def test_at_most_bounds_speed_along_path() -> None:
    plan = kw.plan(reach(line({"at_most": 60})))
    assert active_limits(plan) == ["in to out: its speed is limited by at_most"]
    assert plan.scenario.paths[0].stretches[0].speed == pytest.approx(0.06)


def test_chosen_speed_keeps_direction() -> None:
    beyond = {"position": [400, 200, 350], "rpy": [180, 0, 0]}
    middle = {"position": [400, 0, 300], "rpy": [180, 0, 0]}
    tasks = [
        reach({"pose": middle, "speed": speed}, {"pose": beyond}, times="fastest")
        for speed in ("fastest", {"at_most": 100}, 100)
    ]
    free, capped, given = (kw.plan(task) for task in tasks)
    for plan in (free, capped, given):
        plan.report.raise_if_failed()
    twists = [plan.scenario.waypoints[1].linear for plan in (free, capped, given)]  # type: ignore[union-attr]
    assert np.linalg.norm(twists[0]) > 0.2
    assert np.linalg.norm(twists[1]) == pytest.approx(0.1, rel=1e-5)
    assert np.allclose(np.cross(twists[0], twists[2]), 0.0, atol=1e-12)
    assert free.trajectory.duration < capped.trajectory.duration
    assert capped.trajectory.duration == pytest.approx(given.trajectory.duration, rel=2e-2)


def test_a_path_may_end_in_a_wait() -> None:
    task = {
        "robot": "ur5",
        "times": "fastest",
        "limits": {"acceleration": 8, "jerk": 200},
        "waypoints": [
            {"name": "a", "pose": {"position": [0.4, -0.1, 0.3], "rpy": [3.1, 0, 0]}},
            {"name": "b", "pose": {"position": [0.4, 0.1, 0.3], "rpy": [3.1, 0, 0]}, "stop": True},
            {"along": "line", "pose": {"position": [0.4, 0.2, 0.3]}, "speed": 0.1, "wait": 0.3},
            {"name": "d", "pose": {"position": [0.4, -0.1, 0.3], "rpy": [3.1, 0, 0]}},
        ],
    }
    plan = passing_plan(task)
    assert plan.report.select(subject="wait")


@pytest.mark.parametrize("limits", first_of({"used_fraction": 0.3}, {"velocity": 20}))
def test_joints_follow_path_at_chosen_speed(limits: dict[str, Any]) -> None:
    passing_plan(reach(line("fastest"), limits=limits))


def test_speed_along_path_stays_below_tool_limit() -> None:
    limits = {"acceleration": 400, "tool_speed": 200}
    before = {"name": "in", "pose": {"position": [400, -200, 300], "rpy": [180, 0, 0]}}
    ready = {"name": "ready", "pose": {"position": [400, -300, 350], "rpy": [180, 0, 0]}}
    points = [ready, before, line("fastest")]
    plan = passing_plan(reach(times="fastest", limits=limits, waypoints=points))
    assert plan.scenario.paths[0].stretches[0].speed == pytest.approx(0.1998, rel=5e-3)
    assert plan.chosen_values.optimality_gap < 0.05  # the tool's way bounds the time


def test_refuses_path_speed_beyond_joint_limit() -> None:
    """The proposed `speed: fastest` is feasible, and 2 % more is not."""

    def task(speed: float | str) -> dict[str, Any]:
        first, last = (
            {"pose": {"position": [450, y, 200], "rpy": [180, 0, 0]}} for y in (-200, 200)
        )
        stroke = {**last, "name": "out", "along": "line", "speed": speed}
        points = [{"joints": "home"}, {**first, "name": "in"}, stroke, {"joints": "home"}]
        limits = {"acceleration": 400, "jerk": 6000}
        return reach(times="fastest", limits=limits, waypoints=points)

    says = (
        r"waypoints\[2\]\.speed: at {:g} mm/s along the path from 'in' to 'out': '.*_joint' "
        r"reaches 1\..* times its limit of acceleration; accepted: speed: fastest, or"
    )
    with pytest.raises(InputError, match=says.format(1300)):
        kw.plan(task(1300))
    fastest = passing_plan(task("fastest"))
    speed = 1.02e3 * fastest.scenario.paths[0].stretches[0].speed
    with pytest.raises(InputError, match=says.format(speed)):
        kw.plan(task(speed))


def test_link_speed_limit_bounds_speed_along_path() -> None:
    limits = {"acceleration": 400, "frame_speed": {"frame": "forearm_link", "speed": 50}}
    plan = kw.plan(reach(line("fastest"), limits=limits))
    path = plan.scenario.paths[0].stretches[0]
    assert plan.joints.robot is not None
    along = plan.trajectory.breaks
    along = along[(along >= path.start) & (along <= path.end)]
    bound = kw.verification.tool_speed_bound(
        plan.joints.robot, plan.trajectory, frame="forearm_link", limit=0.05
    )
    assert bound.value > 0.045
    assert bound.ok or not along[0] <= bound.time <= along[-1]


@pytest.mark.exhaustive
def test_tool_acceleration_bounds_speed_along_arc() -> None:
    """On a half circle of 200 mm, by the root of 1200 times 200."""
    arc = line("fastest") | {"along": {"arc": {"through": [600, 0, 300]}}}
    plan = passing_plan(reach(arc, limits={"acceleration": 400, "tool_acceleration": 1200}))
    assert 0.98 < 1e3 * plan.scenario.paths[0].stretches[0].speed / 489.9 <= 1.0


def beside_a_box(size: list[float], position: list[float], **more: Any) -> dict[str, Any]:
    there = {"position": [0.38, 0.29, 0.31], "rotation_vector": [math.pi, 0, 0]}
    return {
        "robot": "ur5",
        "start": "home",
        "times": "fastest",
        "limits": {"acceleration": 10, "jerk": 200},
        "scene": {"objects": {"box": {"box": size, "position": position}}},
        "waypoints": [{"pose": there}],
        **more,
    }


def with_too_short_a_budget(task: dict[str, Any]) -> kw.Plan:
    budget = 0.2
    return kw.plan(task, budget=budget, progress=lambda _: time.sleep(1.5 * budget))


def test_budget_covers_all_sequences() -> None:
    """The second best sequence is planned, as the best collides, but not once it has ended."""
    task = beside_a_box([0.12, 0.06, 0.09], [0.23, 0.27, 0.38])
    assert kw.plan(task).report.select(quantity="sequences_tried")
    plan = with_too_short_a_budget(task)
    assert not plan.report.select(quantity="sequences_tried")


def test_next_best_sequence_is_planned_with_chosen_speeds_along_paths() -> None:
    """The best one collides; the waypoints of others had provisional speeds."""
    task = beside_a_box([0.12, 0.06, 0.09], [0.23, 0.27, 0.38])
    stroke = {"along": "line", "pose": {"position": [0.38, 0.34, 0.31]}, "speed": "fastest"}
    plan = passing_plan(task | {"waypoints": [*task["waypoints"], stroke]})
    (tried,) = plan.report.select(quantity="sequences_tried")
    assert "the best sequence of solutions collides; of" in tried.message


def test_plan_reports_and_freezes_choice(knotwork: Command, tmp_path: Path) -> None:
    frozen, out = tmp_path / "frozen.yaml", tmp_path / "out"
    ran = knotwork(
        "plan", "paper_case_fastest", "--freeze", frozen, "--budget", "3600s", "--out", out
    )
    assert (ran.code, ran.err) == (0, "")
    assert "above the lower bound" in ran.out
    assert "A to B: limited by " in ran.out
    assert f"wrote {frozen}" in ran.out
    again = knotwork("plan", frozen, "--json").done()
    stored = json.loads((out / "trajectory.json").read_text())
    assert json.loads(again)["plans"][0]["trajectory"] == stored
    assert knotwork("check", out, "-s", frozen).code == 0
    assert "scenario.yaml" in knotwork("check", out, "-s", "paper_case_fastest").refused()


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("10", 10), ("10s", 10), ("500ms", 0.5), ("5m", 300), ("2min", 120), ("1h", 3600)],
)
def test_a_time_is_read_with_its_unit(
    text: str, seconds: float, knotwork: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object, budget: float, **__: object) -> NoReturn:
        raise kw.InputError(f"{budget} s")

    monkeypatch.setattr("knotwork.planning.plan", refused)
    ran = knotwork("plan", "paper_case_fastest", "--budget", text)
    assert ran.err == f"error: {float(seconds)} s\n"
