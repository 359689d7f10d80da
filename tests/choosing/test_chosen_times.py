"""Times and speeds that a scenario leaves free: chosen, frozen, planned again."""

from __future__ import annotations

import math
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
import yaml

import knotwork as kw
from knotwork.errors import InputError, OptionError
from knotwork.planning import planning
from knotwork.planning.timing.budget import Budget
from knotwork.task.scenario import load_scenario
from plans import passing_plan
from texts import written

LIMITS = {"velocity": 2, "acceleration": 4}
SMOOTH = {**LIMITS, "jerk": 40}


def swing(*waypoints: dict[str, Any], **keys: Any) -> dict[str, Any]:
    """Two joints from 0, through waypoints, as fast as may be."""
    first = {"name": "first", "joints": {"a": 0, "b": 0}}
    return {"times": "fastest", "limits": SMOOTH, "waypoints": [first, *waypoints], **keys}


def to(a: float, b: float = 0.0, **keys: Any) -> dict[str, Any]:
    return {"joints": {"a": a, "b": b}, **keys}


def test_single_joint_matches_closed_form() -> None:
    """With jerk J, acceleration A and velocity V reached: D/V + V/A + A/J."""
    plan = passing_plan(swing(to(2)))
    exact = 2 / 2 + 2 / 4 + 4 / 40
    assert exact <= plan.trajectory.duration < (1 + 1e-5) * exact
    assert plan.chosen_values.lower_bound == pytest.approx(2 / 2 + 2 / 4)  # without the jerk
    assert plan.chosen_values.lower_bound <= plan.trajectory.duration


def test_planned_scenario_has_no_free_times() -> None:
    plan = kw.plan(swing(to(1, velocity="free"), to(2)))
    assert plan.scenario.unknowns is None
    assert plan.scenario.times[-1] == pytest.approx(plan.trajectory.end_time)
    velocity = plan.joints.targets[1].velocity
    assert np.allclose(plan.trajectory.velocity(plan.scenario.times[1]), velocity, atol=1e-12)
    assert velocity[0] > 1.5  # passed, not stopped at


def test_planned_scenario_continues_same_motion() -> None:
    plan = kw.plan(swing(to(2))).replan(0.5, swing(to(1)))
    assert plan.scenario.continued_motion[1] == 0.5


def test_keeps_waits_and_given_times() -> None:
    plan = passing_plan(swing(to(1, wait=0.3), to(2, after=1.7, stop=True), to(0)))
    times = plan.scenario.times
    assert times[2] - times[1] == pytest.approx(0.3, abs=1e-12)
    assert times[3] - times[2] == pytest.approx(1.7, abs=1e-12)
    inside = np.linspace(times[1], times[2], 50)
    assert np.ptp(plan.trajectory.position(inside), axis=0).max() == 0.0


def test_at_least_bounds_a_time_from_below() -> None:
    plan = kw.plan(swing(to(0.1, after={"fastest": True, "at_least": 0.8})))
    assert 0.8 <= plan.trajectory.duration < 0.801


def test_after_fastest_at_single_waypoint() -> None:
    task = swing(to(1, after=2, stop=True), to(2, after="fastest"))
    del task["times"]
    times = kw.plan(task).scenario.times
    assert times[1] == 2.0
    assert times[2] < 3.2


def test_margin_applies_to_planning_and_check() -> None:
    plan = passing_plan(swing(to(2), limits={**SMOOTH, "used_fraction": 0.5}))
    assert plan.trajectory.extrema("velocity").peak[0] <= 1.0
    (finding,) = plan.report.select(name="a", quantity="velocity")
    assert finding.limit == pytest.approx(1.0)


def test_given_duration_gives_smoothest_motion() -> None:
    """From rest to rest without acceleration at the ends; the quintic is no cubic, but near."""
    plan = passing_plan(swing(to(1), duration=4.0))
    assert plan.trajectory.duration == pytest.approx(4.0, abs=1e-9)
    quintic = 720.0 / 4.0**5  # integral of jerk squared of the minimum over all curves
    jerk = plan.trajectory.polynomial.derivative(3)
    squared = float((np.diff(jerk.x)[:, None] * jerk.c[-1] ** 2).sum())
    assert quintic <= squared < 1.15 * quintic


def test_optimal_knots_have_less_jerk_than_paper() -> None:
    ends = [to(0.0), to(0.5, velocity={"a": 0.4}, after=2), to(2.0, after=3)]
    task = {"waypoints": ends}

    def squared_jerk(**keys: Any) -> float:
        jerk = kw.plan({**task, **keys}).trajectory.polynomial.derivative(3)
        return float((np.diff(jerk.x)[:, None] * jerk.c[-1] ** 2).sum())

    assert squared_jerk(knots="optimal") < squared_jerk(knots="paper")
    plan = passing_plan({**task, "knots": "optimal"})
    tight = {"velocity": 8, "acceleration": 60, "jerk": 100}  # they do not bind
    assert squared_jerk(knots="optimal") == pytest.approx(
        squared_jerk(limits=tight, knots="optimal"), rel=5e-3
    )
    assert plan.trajectory.end_time == 5.0


def test_segments_rest_after_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that goes on by a second each time it is looked at."""
    task = swing(
        *(to(one, -0.5, velocity="free") for one in (1, 2, 3)),
        to(4, wait=0.1),
        to(3, stop=True),
        to(2),
    )
    best = kw.plan(task)
    monkeypatch.setattr(planning, "Budget", lambda *given: Budget(*given, now=count().__next__))
    plan = passing_plan(task, budget=2)
    assert plan.chosen_values.status == "budget"
    assert plan.trajectory.duration < 1.2 * best.trajectory.duration
    (finding,) = [one for one in plan.report.warnings if one.group == "Chosen times"]
    assert "the best so far when the budget ended" in str(finding)
    hasty = passing_plan(task, budget=1)
    assert hasty.chosen_values.status == "budget"
    assert plan.trajectory.duration < hasty.trajectory.duration
    shorter = 0.5 * (plan.trajectory.duration + hasty.trajectory.duration)
    with pytest.raises(InputError, match=r"minimum time found .* s or more, or a larger budget"):
        kw.plan({**task, "duration": shorter}, budget=1)
    with pytest.raises(InputError, match="budget"):
        kw.plan(task, budget=-1)
    with pytest.raises(InputError, match="budget is -1; it must be a positive"):
        kw.plan("paper_case", budget=-1)
    with pytest.raises(InputError, match=r"accepted: acceleration: \{joint: value, …\}$"):
        kw.plan({**task, "limits": {}})


def test_the_same_task_gives_the_same_bytes(tmp_path: Path) -> None:
    task = swing(to(1, -0.5, velocity="free"), to(2))
    files = [kw.plan(task).save(tmp_path / str(i)) for i in range(2)]
    for one, other in zip(*files, strict=True):
        assert one.read_bytes() == other.read_bytes()
    again = kw.plan(tmp_path / "0" / "scenario.yaml")
    assert np.array_equal(again.trajectory.polynomial.c, kw.plan(task).trajectory.polynomial.c)


FILE = """\
# A swing; this comment and all others stay.
units: {angle: deg}
times: fastest # as fast as may be
limits: {velocity: 120, acceleration: 240, jerk: 2400}
waypoints:
  # from here
  - {name: first, joints: {a: 0, b: 0}}
  - name: via
    joints: {a: 60, b: -30} # passed
    velocity: free
    after: # longer than it must be
      fastest: true # or nearly
      at_least: 0.9
  - name: last
    joints: {a: 120, b: 0}
"""


def test_a_frozen_scenario_keeps_its_comments_and_gives_the_same_motion(tmp_path: Path) -> None:
    plan = kw.plan(written(tmp_path / "swing.yaml", FILE))
    text = plan.freeze(tmp_path / "frozen.yaml").read_text()
    comments = [line.partition("#")[2] for line in FILE.splitlines() if "#" in line]
    assert [line.partition("#")[2] for line in text.splitlines() if "#" in line] == comments
    assert "fastest" not in text
    assert "room" not in text
    again = kw.plan(tmp_path / "frozen.yaml")
    assert again.chosen_values is None
    assert again.scenario.unknowns is None
    assert np.array_equal(again.trajectory.polynomial.x, plan.trajectory.polynomial.x)
    assert np.array_equal(again.trajectory.polynomial.c, plan.trajectory.polynomial.c)
    assert kw.check(plan.trajectory, load_scenario(tmp_path / "frozen.yaml")).ok
    plan.save(tmp_path / "out")
    saved = tmp_path / "out" / "scenario.yaml"
    assert saved.read_text() == text + "name: swing\n"
    again.scenario.source.rename(saved)
    kw.plan(saved).save(tmp_path / "out")
    assert saved.read_text() == text
    saved.write_text(FILE)
    with pytest.raises(InputError, match=r"out/scenario.yaml: would be replaced .* another folder"):
        kw.plan(saved).save(tmp_path / "out")
    assert saved.read_text() == FILE
    with pytest.raises(
        OptionError, match=r"chosen: planner 'quintic': option chosen is not supported"
    ):
        kw.plan({**yaml.safe_load(text), "planner": "quintic"})


def test_paths_in_a_frozen_file_hold_from_its_own_folder(tmp_path: Path) -> None:
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "box.stl")
    (tmp_path / "dot.csv").write_text("x,y,z\n0,0,0\n")
    source = written(
        tmp_path / "arm.yaml",
        "robot: planar2\ntimes: fastest\nlimits: {velocity: 2, acceleration: 4}\n"
        "scene: {objects: {box: {mesh: box.stl, position: [9, 0, 0]},"
        " dot: {points: {file: dot.csv, resolution: 0.1}, position: [9, 0, 0]}}}\n"
        "waypoints:\n  - joints: {shoulder: 0, elbow: 0}\n"
        "  - {joints: {shoulder: 1, elbow: 1}, do: {file: dot.csv}}\n",
    )
    assert kw.Task.load(source).waypoints[1].to_dict()["do"] == {"file": "dot.csv"}  # a signal
    saved = kw.plan(source).save(tmp_path / "out")[0].parent / "scenario.yaml"
    assert "mesh: ../box.stl" in saved.read_text()
    assert "file: ../dot.csv" in saved.read_text()
    assert kw.plan(saved).report.ok


def test_reports_aliases_that_cannot_be_edited(tmp_path: Path) -> None:
    source = written(
        tmp_path / "alias.yaml",
        "times: fastest\nlimits: {velocity: 2, acceleration: 4}\nwaypoints:\n"
        "  - {joints: &here {a: 0}}\n  - &one {joints: {a: 1}, stop: true}\n"
        "  - {joints: *here, stop: true}\n  - *one\n",
    )
    plan = kw.plan(source)
    with pytest.raises(InputError, match="aliases"):
        plan.freeze(tmp_path / "frozen.yaml")
    assert not (tmp_path / "frozen.yaml").exists()
    plan.save(tmp_path / "out")
    saved = tmp_path / "out" / "scenario.yaml"
    assert "aliases" in saved.read_text().splitlines()[0]
    assert np.array_equal(kw.plan(saved).trajectory.breaks, plan.trajectory.breaks)


def test_reports_stale_frozen_scenario(tmp_path: Path) -> None:
    plan = kw.plan(swing(to(1, velocity="free", name="via"), to(2)))
    path = plan.freeze(tmp_path / "frozen.yaml")
    text = path.read_text()
    moved = text.replace("joints: {a: 2.0, b: 0.0}", "joints: {a: 2.5, b: 0.0}")
    assert moved != text
    path.write_text(moved)
    with pytest.raises(InputError, match=r"chosen.*for other waypoints than waypoint 'via'.*again"):
        kw.plan(path)


def test_refuses_check_against_free_times() -> None:
    task = swing(to(2))
    plan = kw.plan(task)
    with pytest.raises(InputError, match="leaves times or speeds to planning"):
        kw.check(plan.trajectory, load_scenario(task))


def test_all_planners_get_the_chosen_times() -> None:
    task = swing(to(1, 0.5, velocity="free"), to(2))
    comparison = kw.compare(task, ["modified-hermite", "modified-hermite:paper", "quintic"])
    assert comparison.times_chosen
    durations = {row.duration for row in comparison.scores}
    assert durations == {kw.plan(task).trajectory.duration}
    chosen, paper, _ = comparison.scores
    assert chosen.passed
    assert not paper.passed
    assert not kw.compare("paper_case", ["cubic"]).times_chosen


def test_report_lists_chosen_times() -> None:
    plan = kw.plan(swing(to(1, velocity="free", name="via"), to(2, name="place")))
    findings = plan.report.select(group="Chosen times")
    assert {one.quantity for one in findings} >= {"duration", "lower_bound", "active_limits"}
    texts = [str(one) for one in findings if one.quantity == "active_limits"]
    assert any(one.startswith("via to place: acceleration of 'a' for ") for one in texts)
    data = plan.report_to_dict()["chosen_times"]
    assert data["status"] == "optimal"
    assert data["duration"] == plan.trajectory.duration
    assert data["gap"] == pytest.approx(data["duration"] / data["lower_bound"] - 1)
    assert math.isclose(data["times"]["place"], plan.trajectory.duration)


@pytest.mark.parametrize("keys", [{"knots": "optimal"}, {"times": "fastest", "duration": 2}])
def test_given_duration_is_no_minimum(keys: dict[str, Any]) -> None:
    after = {} if "times" in keys else {"after": 2}
    plan = kw.plan({"limits": SMOOTH, "waypoints": [to(0), to(1, **after)], **keys})
    (duration,) = plan.report.select(quantity="duration")
    assert duration.message == f"{'times' if 'times' in keys else 'motion'} chosen: 2 s, as given"
    assert (duration.group == "Chosen times") == ("times" in keys)
    assert not plan.report.select(quantity="lower_bound")


def test_reports_assumed_jerk_limit() -> None:
    plan = kw.plan(swing(to(1), limits={"velocity": 1, "acceleration": 4}))
    assert plan.chosen_values.assumed_jerk == {"a": 400.0, "b": 400.0}
    texts = [str(finding) for finding in plan.report.select(group="Chosen times")]
    assert any("no jerk limit is given, so one is assumed: 400 rad/s³ for a, b" in s for s in texts)
    assert any("jerk of 'a' (assumed) for " in text for text in texts)
    given = kw.plan(swing(to(1)))
    assert not given.report.select(group="Chosen times", quantity="assumed_jerk")


def given_beside_free(seconds: float, **keys: Any) -> dict[str, Any]:
    """A move in given time, a wait, and a move whose time is free."""
    ends = [{"x": 0, "y": 0}, {"x": 1, "y": -1}, {"x": 2, "y": 0.5}]
    names = zip("abc", ends, strict=True)
    waypoints: list[dict[str, Any]] = [{"name": name, "joints": q} for name, q in names]
    waypoints[1] |= {"after": seconds, "wait": 0.5}
    return {"times": "fastest", "limits": SMOOTH, "waypoints": waypoints, **keys}


def test_given_time_next_to_free_time_keeps_limits() -> None:
    """It takes 1.106 s at least; the paper's knots need far more."""
    plan = passing_plan(given_beside_free(1.15))
    assert plan.scenario.times[1] == 1.15
    assert not kw.plan(given_beside_free(1.15, knots="paper")).report.ok
    with pytest.raises(InputError, match=r"from 'a' to 'b' 1\.05 s are given.* 1\.1\d* s"):
        kw.plan(given_beside_free(1.05))


def test_reports_minimum_time_for_infeasible_duration() -> None:
    """At the given velocities there is no room to stop between the waypoints."""
    ends = [{"joints": {"x": x}, "velocity": {"x": 1}} for x in (0, 1)]
    limits = {"velocity": 2, "acceleration": 0.6, "jerk": 40, "position": {"x": [0, 1]}}
    task = {"times": "fastest", "duration": 5, "limits": limits, "waypoints": ends}
    with pytest.raises(InputError, match=r"the shortest motion found lasts 0\.886"):
        kw.plan(task)


def test_plans_stored_run() -> None:
    run = {"times": [0, 0.2, 0.8, 1], "accelerations": {"a": [0, 7.5, -7.5, 0]}}
    waypoints = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 1}]
    plan = passing_plan({"waypoints": waypoints, "chosen": [run]})
    assert plan.trajectory.breaks.tolist() == [0, 0.2, 0.8, 1]


def test_tries_other_solutions_where_given_times_are_too_short() -> None:
    """The best solutions for chosen times take 0.46 s."""
    task = kw.Task.load("panda_pick_place_fastest")
    quick, hasty = (task.waypoints[2].replace(after=after) for after in (0.42, 0.3))
    *before, _, last = task.waypoints
    passing_plan(task.replace(waypoints=[*before, quick, last]))
    with pytest.raises(kw.errors.TimingError, match=r"best of 4 sequences of solutions tried$"):
        kw.plan(task.replace(waypoints=[*before, hasty, last]))
