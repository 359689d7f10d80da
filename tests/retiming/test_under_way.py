"""A plan while it runs: its laws, and overrides of motions that are at their limits already."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import knotwork as kw
from command_line import Command
from knotwork import planning
from knotwork.errors import InputError
from moving.moving_truth import down
from moving.test_moving_things import belt, tool, tray
from plans import passing_plan, planned
from sweeps import mostly_exhaustive

Task = dict[str, Any]

LIMITS = {"acceleration": 4.0, "jerk": 40.0}


def swing(speed: float = 1.0) -> kw.Plan:
    """One joint that moves evenly at a speed, for 10 s, and at rest before and after."""
    ends = [
        {"joints": {"a": 0.0}},
        {"joints": {"a": speed}, "velocity": {"a": speed}, "after": 2},
        {"name": "late", "joints": {"a": 11 * speed}, "velocity": {"a": speed}, "after": 10},
        {"joints": {"a": 12 * speed}, "after": 2},
    ]
    return kw.plan({"planner": "cubic", "limits": LIMITS, "continuity": 1, "waypoints": ends})


@settings(max_examples=12)
@example(speed=1.21875, part=0.796875)
@given(st.floats(0.2, 1.5), st.floats(0.2, 1.0))
def test_stop_of_even_motion_is_near_closed_form(speed: float, part: float) -> None:
    plan = swing(speed)
    stop = plan.stop(2.0 + 5 * part)
    shortest = speed / 4 + 4 / 40 if speed >= 16 / 40 else 2 * np.sqrt(speed / 40)
    assert shortest * (1 - 1e-9) <= stop.trajectory.duration <= 1.004 * shortest
    assert stop.report.ok
    free = plan.stop(2.0 + 5 * part, on_path=False)
    assert free.trajectory.duration == pytest.approx(shortest, rel=1e-9)
    assert free.report.ok


@pytest.mark.parametrize("at", mostly_exhaustive([0.7, 3.0, 4.9, 8.0, 12.0], 8.0))
@pytest.mark.parametrize("on_path", [True, False])
def test_stop_keeps_state_limits_and_path(deburring: kw.Plan, at: float, on_path: bool) -> None:
    stop = deburring.stop(at, on_path=on_path)
    was, now = deburring.trajectory, stop.trajectory
    for nu in range(3):
        assert np.abs(now(0.0, nu) - was(at, nu)).max() < 1e-12
    for nu in (1, 2):
        assert np.abs(now(now.end_time, nu)).max() < 1e-10
    joints = deburring.joints
    for kind in ("acceleration", "jerk"):
        peak = now.extrema(kind).peak
        assert (peak <= joints.limits[kind] * (1 + 1e-9)).all()
    if on_path:
        places = was.position(np.linspace(at, min(at + now.duration, was.end_time), 20001))
        for q in now.position(np.linspace(0, now.end_time, 20)):
            assert np.abs(places - q).max(axis=1).min() < 1e-5
    else:
        assert now.duration <= deburring.stop(at).trajectory.duration * (1 + 1e-9)


@pytest.mark.parametrize("profile", [{0: 0.7}, {0: 0.7, 3 / 0.7: 0.7}])
def test_override_may_change_where_motion_ends(profile: dict[float, float]) -> None:
    """Two breaks of the clock once were equal within rounding, and no motion was found."""
    joints = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 3}]
    belt = {"belt": {"position": [0, 0, 0], "moves": {"linear": [0.1, 0, 0]}}}
    plan = kw.plan({"limits": LIMITS, "waypoints": joints, "frames": belt, "frame": "belt"})
    slow = plan.scaled(profile)
    assert slow.report.ok
    assert slow.trajectory.duration == pytest.approx(3 / 0.7)
    assert [waypoint.name for waypoint in slow.scenario.waypoints] == ["waypoint 1", "waypoint 2"]
    assert plan.scaled({0: 1, 0.6: 1, 0.61: 0}).report.select(quantity="override")


def test_override_above_1_fails_beyond_limit(deburring: kw.Plan) -> None:
    fast = deburring.scaled({0: 2.5})
    assert fast.trajectory.duration == pytest.approx(deburring.trajectory.duration / 2.5)
    assert {one.quantity for one in fast.report.failures} >= {"acceleration", "tool_speed"}
    slow, quick = (plan.trajectory.extrema("acceleration").peak for plan in (deburring, fast))
    assert quick == pytest.approx(2.5**2 * slow, rel=1e-4)


HOME = {"robot": "ur5", "limits": {"acceleration": 6, "jerk": 60}}
GOAL = {**HOME, "waypoints": [{"joints": "home", "after": "fastest"}]}


@pytest.mark.parametrize(
    "task",
    [
        GOAL,
        {**GOAL, "start": "home"},
        {**GOAL, "waypoints": [{"joints": "home"}, *GOAL["waypoints"]], "end_acceleration": "zero"},
        {**GOAL, "units": {"angle": "deg"}, "limits": {"acceleration": 300}},
    ],
)
def test_replacing_goal_has_no_jump(deburring: kw.Plan, task: Task) -> None:
    after = deburring.replan(8.0, task)
    assert after.report.ok
    for nu in range(3):
        jump = after.trajectory(0.0, nu) - deburring.trajectory(8.0, nu)
        assert np.abs(jump).max() <= 1e-12
    assert np.abs(after.trajectory(after.trajectory.end_time, 1)).max() < 1e-10


WAIT_AND_SWITCH = {"do": [{"wait": 0.25}, {"light": "on"}, {"wait": 0.25}]}


@pytest.mark.parametrize(("wait", "switched"), [({"wait": 0.5}, []), (WAIT_AND_SWITCH, [0, 0.25])])
def test_first_waypoint_waits_if_the_motion_is_at_rest(wait: Task, switched: list[float]) -> None:
    first = {"name": "here", "joints": {"a": 0.0}}
    ends = [first | wait, {"joints": {"a": 1.0}, "after": 2}]
    task = {"waypoints": ends}
    motion = kw.plan(task)
    new = motion.replan(0.3, task)
    assert new.scenario.times.tolist() == [0.0, 0.5, 2.5]
    assert [
        event.time for event in new.events
    ] == switched  # what was on is on until it is switched
    with pytest.raises(InputError, match="'here' waits, but the motion is not at rest at 1 s"):
        motion.replan(1.0, task)


@pytest.mark.parametrize(
    ("task", "words"),
    [
        ("paper_case", "unknown joint"),
        ("xarm7_bead", "the motion that it continues has shoulder_pan_joint"),
        ({**GOAL, "planner": "cubic", "waypoints": [{"joints": "home", "after": 2}]}, "'cubic'"),
    ],
)
def test_refuses_unreachable_new_goals(deburring: kw.Plan, task: str | Task, words: str) -> None:
    with pytest.raises(InputError, match=words):
        deburring.replan(1.0, task)


BALL = {"sphere": 0.01}
PART = {"from": "at", "to": "put", "allow": ["wrist_3_link", "ee_link"], **BALL}


@pytest.fixture(scope="module")
def moving_part() -> kw.Plan:
    """A UR5 takes a ball from a belt at 3 s, and puts it down at 7.1 s."""
    along = belt()["waypoints"][2]
    put, off = (down(0.45, 0.25, z) for z in (0.2, 0.4))
    waypoints = [
        *belt()["waypoints"][:2],
        {**along, "name": "along"},
        {"name": "put", "frame": "base", "pose": put, "after": 2, "stop": True},
        {"frame": "base", "pose": off, "after": 1, "velocity": {"linear": [0, 0, 0.05]}},
        {"joints": "home", "after": 3},
    ]
    holding = {"shape": BALL, "holds": {"part": PART}}
    limits = {"acceleration": 20, "jerk": 400}
    return passing_plan(belt(tool=holding, limits=limits, waypoints=waypoints))


@pytest.mark.parametrize("at", [1.0, 9.0])
@pytest.mark.parametrize("on_path", [True, False])
def test_stop_checks_objects_of_that_time(moving_part: kw.Plan, at: float, on_path: bool) -> None:
    stop = moving_part.stop(at, on_path=on_path)
    (found,) = [one for one in stop.report.findings if one.name in ("tool, part", "part, tool")]
    lies = np.array([0.45, 0.25, 0.2])
    gaps = [
        np.linalg.norm(
            tool(stop, t)[0].translation
            - (tray(at + t).act(np.array([0.0, 0.0, 0.1])) if at < 3 else lies)
        )
        - 0.02
        for t in np.linspace(0, stop.trajectory.end_time, 50)
    ]
    assert found.value == pytest.approx(min(gaps), rel=0.01)
    assert stop.report.ok


def test_new_task_keeps_object(moving_part: kw.Plan, tmp_path: Path, knotwork: Command) -> None:
    stop = moving_part.stop(5.5)
    (held,) = stop.scenario.scene.held
    names = [waypoint.name for waypoint in stop.scenario.waypoints]
    assert (names[held.taken_at], names[held.released_at]) == ("stop from 5.5 s", "stopped")
    stop.save(tmp_path)
    assert knotwork("check", tmp_path).code == 0
    with pytest.raises(InputError, match=r"holds 'part' at 5\.5 s"):
        moving_part.replan(5.5, GOAL)
    tcp = {"part": {**PART, "from": "start", "to": "waypoint 1"}}
    goal = {**GOAL, "tool": {"shape": BALL, "holds": tcp}}
    assert moving_part.replan(5.5, goal).report.ok
    with pytest.raises(InputError, match=r"waypoints\[0\]: is in a moving frame"):
        moving_part.scaled({0: 0.5})


@pytest.mark.parametrize("at", mostly_exhaustive([0.9, 1.2, 2.0], 1.2))
def test_released_parts_stay_in_place(at: float) -> None:
    """An override of 0 ends on the way; a stop may begin where a part is taken."""
    plan = planned("panda_pick_place")
    for changed in (plan.scaled({0: 1, at: 0}), plan.stop(at), plan.stop(at, on_path=False)):
        (held,) = changed.scenario.scene.held
        assert held.released_at == len(changed.scenario.waypoints) - 1
        assert changed.report.ok


def test_check_reads_what_replan_writes(tmp_path: Path, knotwork: Command) -> None:
    file = tmp_path / "goal.yaml"
    kw.Task(**GOAL).save(file)
    assert knotwork("plan", "ur5_deburring", "-o", tmp_path / "old").code == 0
    knotwork("replan", tmp_path / "old", file, "--at", "3.2", "-o", tmp_path / "new").done()
    assert knotwork("check", tmp_path / "new").code == 0
    old, new = (kw.load_trajectory(tmp_path / name) for name in ("old", "new"))
    for nu in range(3):
        assert np.abs(new(0.0, nu) - old(3.2, nu)).max() <= 1e-12
    message = tmp_path / "old.yaml"
    assert knotwork("export", tmp_path / "old", "-f", "ros2", "-o", message).code == 0
    assert knotwork("replan", message, file, "--at", "3200ms").code == 0
    for options, words in (
        (("old", "goal.yaml", "--at", "99"), "99 s is outside the curve"),
        (("old", "paper_case", "--at", "1"), "paper_case: waypoints[1].joints.joint_1"),
        (("old.yaml", "paper_case", "--at", "1"), "needs a robot"),
    ):
        paths = [tmp_path / one if (tmp_path / one).exists() else one for one in options]
        assert words in knotwork("replan", *paths).refused()
    changed = tmp_path / "old" / "trajectory.json"
    changed.write_text(changed.read_text() + "\n")
    assert "changed after" in knotwork("replan", tmp_path / "old", file, "--at", "3.2").refused()


def test_replan_plans_running_motion_with_budget(tmp_path: Path, knotwork: Command) -> None:
    ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 1}]
    task = kw.Task.load({"limits": {"velocity": 1.2}, "waypoints": ends})
    file = task.save(tmp_path / "lift.yaml")
    with patch.object(planning, "plan", wraps=kw.plan) as plan:
        replanned = knotwork("replan", file, file, "--at", "0.5", "--budget", "9s")
    assert [call.kwargs["budget"] for call in plan.call_args_list] == [9.0, 9.0]
    assert "lift, modified-hermite: the check FAILS" in replanned.err


@pytest.mark.parametrize(
    ("profile", "words"),
    [
        ({}, "no values"),
        ({0: -0.5}, "override -0.5"),
        ({-1: 1.0}, "time -1"),
        ({0: float("nan")}, "nan"),
        ({0: 0.0}, "the arm would not move"),
        ({0: "a"}, "override is 'a'; it must be a finite number"),
        ({"a": 1.0}, "time of the profile is 'a'"),
        ([1, 2], "override profile is .*; accepted: a mapping of times to overrides"),
    ],
)
def test_refuses_meaningless_profiles(profile: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        swing().scaled(profile)


def test_refuses_impossible_stops() -> None:
    with pytest.raises(InputError, match="15"):
        swing().stop(15.0)
    joints = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 2}]
    with pytest.raises(InputError, match="no acceleration limit"):
        kw.plan({"waypoints": joints}).stop(1.0)
    half = kw.plan({"limits": {"acceleration": 4}, "waypoints": joints})
    with pytest.raises(InputError, match="no jerk limit"):
        half.stop(1.0, on_path=False)
    calm = {"limits": LIMITS, "end_acceleration": "zero", "waypoints": joints}
    with pytest.raises(InputError, match="is at rest"):
        kw.plan(calm).stop(2.0, on_path=False)


LIMITS_WITH_VELOCITY = {"acceleration": 4.0, "jerk": 40.0, "velocity": 1.5}


@pytest.fixture(scope="module")
def fastest() -> kw.Plan:
    ends = [{"joints": {"a": a, "b": b}} for a, b in ((0, 0), (1, -2), (3, 0.3))]
    ends[1] |= {"velocity": "free"}
    return kw.plan({"limits": LIMITS_WITH_VELOCITY, "times": "fastest", "waypoints": ends})


def messages(plan: kw.Plan) -> list[str]:
    return [finding.message for finding in plan.report.findings if finding.quantity == "override"]


def test_constant_override_keeps_limits(fastest: kw.Plan) -> None:
    same = fastest.scaled({0: 1})
    assert same.report.ok
    assert not messages(same)
    for nu in range(4):
        was, now = (one.trajectory.polynomial.extrema(nu).peak for one in (fastest, same))
        np.testing.assert_allclose(now, was, rtol=1e-12)


@pytest.mark.parametrize(
    "profile",
    [
        {0: 1, 0.3: 0.5},
        {0: 1, 0.7: 0.3, 1.4: 1},
        {0: 0.5, 2: 1},
        {0: 1, 0.8: 1, 1.0: 0, 1.3: 0, 1.5: 1},
        {0: 0.9, 0.1: 0.2, 0.2: 0.9},
    ],
)
def test_overrides_keep_limits(fastest: kw.Plan, profile: dict[float, float]) -> None:
    plan = fastest.scaled(profile)
    assert plan.report.ok
    run = dict(profile)
    for message in messages(plan):
        pairs = re.findall(r"([\d.]+): ([\d.]+)", message.rpartition("instead")[2])
        run = {float(time): float(rate) for time, rate in pairs}
        assert run != profile
    # the time shown by quadrature of the reported override, which is rounded to 3 digits
    t = np.linspace(0, plan.trajectory.duration, 20001)
    times, rates = np.array(list(run)), np.array(list(run.values()))
    i = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
    u = np.clip((t - times[i]) / np.diff(times)[i], 0, 1)
    level = np.where(u < 0.5, 2 * u**2, 1 - 2 * (1 - u) ** 2)
    rate = rates[i] + (rates[i + 1] - rates[i]) * level
    shown = np.append(0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t)))
    shown = np.minimum(shown, fastest.trajectory.duration)
    gap = plan.trajectory.position(t) - fastest.trajectory.position(shown)
    assert np.abs(gap).max() < 5e-3
    assert shown[-1] == pytest.approx(fastest.trajectory.duration, abs=5e-3)
    # and it is near the requested one
    assert min(abs(one - max(profile.values())) for one in run.values()) < 0.12
    assert min(run.values()) == min(profile.values())


def test_reports_infeasible_override_change(fastest: kw.Plan) -> None:
    assert messages(fastest.scaled({0: 1, 0.8: 1, 0.85: 0.2, 0.9: 1}))
