"""Motions that find their own way: clear, fast, and like any other motion afterwards."""

from __future__ import annotations

import copy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from judged import judged
from knotwork.errors import InputError, NoWayFoundError
from knotwork.joint_quantities import JointLimits
from knotwork.planning.clear_motions.configuration_space import ConfigurationSpace
from knotwork.scene.building import build_robot_collision_model
from plans import passing_plan
from sweeps import first_of, mostly_exhaustive
from walls import DOWN, at, box, past


def planned(given: dict[str, Any]) -> kw.Plan:
    """A plan that passes its check and the judge."""
    plan = passing_plan(given)
    assert judged(plan, copy.deepcopy(given)) == []
    return plan


@cache
def past_wall() -> kw.Plan:
    """The plan past the wall, made once."""
    return planned(past())


def without_way(given: dict[str, Any], seconds: float) -> dict[str, Any]:
    plain = copy.deepcopy(given)
    del plain["waypoints"][1]["way"]
    plain["waypoints"][1]["after"] = seconds
    return plain


def test_finds_motion_past_wall() -> None:
    plan = past_wall()
    direct = kw.plan(without_way(past(), plan.trajectory.duration))
    assert not direct.report.ok
    assert plan.chosen_values.lower_bound <= plan.trajectory.duration < 1.0
    assert [(segment.name, segment.kind) for segment in plan.segments] == [("here to there", "way")]
    assert [segment.kind for segment in direct.segments] == ["free motion"]


def test_frozen_clear_motion_is_the_same(tmp_path: Path) -> None:
    plan = past_wall()
    again = passing_plan(plan.freeze(tmp_path / "frozen.yaml"))
    assert again.trajectory.polynomial.c.tobytes() == plan.trajectory.polynomial.c.tobytes()
    assert "way: clear" not in (tmp_path / "frozen.yaml").read_text()
    (way,) = again.report.select(quantity="way")
    assert way == plan.report.select(quantity="way")[0]
    assert [segment.kind for segment in again.trajectory.segments] == ["way"]


def test_straight_clear_motion_is_optimal() -> None:
    ends = [{"joints": OUTSIDE | {"shoulder_pan_joint": q}} for q in (0, 90)]
    plan = planned({**past({}), "waypoints": [ends[0], ends[1] | {"way": "clear"}]})
    assert plan.chosen_values.status == "optimal"


def test_consecutive_clear_motions_meet() -> None:
    back = at("back", -250, 150, way={"clear": True, "tries": 1})
    plan = planned(past(None, back))
    assert len(plan.scenario.waypoints) == 3


@pytest.mark.exhaustive
def test_chooses_solutions_at_both_ends(tmp_path: Path) -> None:
    given = past({"post": box([200, 200, 600], [400, 40, 300])})
    for waypoint, y, z in zip(given["waypoints"], (-350, 350), (340, 220), strict=True):
        waypoint["pose"]["position"] = [450, y, z]
    plan = planned(given)
    before = plan.chosen_values.solution.waypoints.position[0]
    assert np.abs(plan.trajectory.position(0.0) - before).max() > 1.0
    assert plan.chosen_values.lower_bound <= plan.trajectory.duration
    again = kw.plan(plan.freeze(tmp_path / "frozen.yaml"))
    assert again.trajectory.polynomial.c.tobytes() == plan.trajectory.polynomial.c.tobytes()
    near = dict(zip(plan.joints.joint_names, np.degrees(before).tolist(), strict=True))
    given["waypoints"][0]["near"] = near
    assert planned(given).trajectory.duration > 1.1 * plan.trajectory.duration


def through(**keys: Any) -> dict[str, Any]:
    """Two ways, by a pose in the gap above the wall."""
    given = past(ways="clear")
    pose = {"position": [450, 0, 430], "rpy": DOWN}
    given["waypoints"].insert(1, {"name": "above", "pose": pose, **keys})
    return given


def test_passes_pose_between_clear_motions(tmp_path: Path) -> None:
    plan = planned(through(velocity="free"))
    assert plan.trajectory.duration < kw.plan(through(stop=True)).trajectory.duration
    q = plan.trajectory.position(plan.scenario.times[1])
    assert np.abs(plan.joints.robot.forward(q).translation - [0.45, 0, 0.43]).max() < 1e-8
    again = passing_plan(plan.freeze(tmp_path / "frozen.yaml"))
    assert again.trajectory.polynomial.c.tobytes() == plan.trajectory.polynomial.c.tobytes()


@pytest.mark.parametrize(
    ("after", "duration"),
    first_of(({"fastest": True, "at_least": 1.5}, 1.5), (2, 2.0)),
)
def test_clear_motion_takes_given_time(after: Any, duration: float) -> None:
    given = past()
    given["waypoints"][1]["after"] = after
    assert planned(given).trajectory.duration == pytest.approx(duration, abs=1e-12)


def test_refuses_short_time() -> None:
    given = past()
    given["waypoints"][1]["after"] = 0.72  # enough without a wall
    with pytest.raises(InputError, match="shorter than the fastest motion found") as caught:
        kw.plan(given)
    assert "is enough for a motion" not in str(caught.value)


MOVING = {"linear": [0, 0, 100]}


@pytest.mark.parametrize("after", mostly_exhaustive(["fastest", 4], 4))
def test_keeps_velocities_at_both_ends(after: Any) -> None:
    given = past()
    given["waypoints"][0] |= {"velocity": MOVING}
    given["waypoints"][1] |= {"velocity": {"linear": [0, 0, -100]}}
    del given["waypoints"][0]["stop"], given["waypoints"][1]["stop"]
    given["waypoints"][1]["after"] = after
    plan = planned(given)
    assert after == "fastest" or plan.trajectory.duration == pytest.approx(after, abs=1e-12)
    for time, z in ((0.0, 0.1), (plan.trajectory.end_time, -0.1)):
        q, v = plan.trajectory.position(time), plan.trajectory.velocity(time)
        twist = plan.joints.robot.twist(q, v)
        assert np.abs(twist.linear - [0, 0, z]).max() < 1e-9
        assert np.abs(twist.angular).max() < 1e-9


@pytest.mark.parametrize("end", first_of(0, 1))
def test_brakes_each_joint_independently(end: int) -> None:
    """Straight, the last joint would go as long as the first, beyond its limit."""
    side = (1.0, -1.0)[end]
    given = past()
    ends = [OUTSIDE | {"shoulder_pan_joint": q} for q in (-60, 60)]
    ends[end] |= {"wrist_3_joint": side * 359.4}
    ends[1 - end] |= {"wrist_3_joint": side * 300}
    waypoints = [{"joints": one, "stop": True} for one in ends]
    speeds = {"shoulder_pan_joint": 90, "wrist_3_joint": 10}
    waypoints[end] = {"joints": ends[end], "velocity": dict.fromkeys(OUTSIDE, 0) | speeds}
    waypoints[1]["way"] = "clear"
    plan = planned({**given, "waypoints": waypoints})
    reached = plan.trajectory.position(plan.scenario.times[end])
    assert np.degrees(reached[-1]) == pytest.approx(side * 359.4, abs=1e-9)
    v = np.degrees(plan.trajectory.velocity(plan.scenario.times[end]))
    assert v == pytest.approx([90, 0, 0, 0, 0, 10], abs=1e-9)


@pytest.mark.exhaustive
def test_brakes_gently_enough_for_effort() -> None:
    """A stop at the limit of acceleration would take more effort than there is."""
    start, end = ({"joints": OUTSIDE | {"shoulder_pan_joint": q}} for q in (-60, 60))
    start["velocity"] = dict.fromkeys(OUTSIDE, 0) | {"shoulder_pan_joint": -60}
    limits = {"acceleration": 4000, "jerk": 400000, "effort": {"shoulder_pan_joint": 60}}
    waypoints = [start, end | {"way": "clear"}]
    planned(past(limits=limits, waypoints=waypoints))
    del limits["effort"]
    hard = kw.plan(past(limits=limits, waypoints=waypoints))
    (effort,) = hard.report.select(quantity="effort", name="shoulder_pan_joint")
    assert abs(effort.value) > 60.0


def test_clear_motion_continues_from_tool_path() -> None:
    up = {"name": "up", "pose": {"position": [450, -250, 200]}, "along": "line", "speed": 50}
    given = past()
    given["waypoints"].insert(1, up)
    plan = planned(given)
    end = plan.scenario.times[1]
    q, v = plan.trajectory.position(end), plan.trajectory.velocity(end)
    assert np.linalg.norm(plan.joints.robot.twist(q, v).linear) == pytest.approx(0.05, abs=1e-9)


@pytest.mark.exhaustive
def test_tries_other_solutions_between_tool_paths() -> None:
    """The solutions at both ends come before the way; of the best ones none was found."""
    given = past()
    across = [
        {"name": "p", "pose": {"position": [450, -160, 100]}, "along": "line", "speed": 100},
        {"name": "q", "pose": {"position": [450, 170, 100], "rpy": DOWN}, "way": "clear"},
        {"name": "r", "pose": {"position": [450, 280, 100]}, "along": "line", "speed": 100},
    ]
    given["waypoints"][1:] = across
    (finding,) = planned(given).report.select(quantity="sequences_tried")
    assert "the best sequence of solutions was not found; of" in finding.message


def test_reports_clearance_without_objects() -> None:
    later = {"box": [100, 100, 100], "position": [450, -400, 60], "appears": "there"}
    given = past({"later": later}, at("stay", 300, 150, after=1))
    (way,) = planned(given).report.select(quantity="way")
    assert way.value > 0


@pytest.mark.exhaustive
def test_tool_speed_limit_costs_no_more_in_free_space() -> None:
    """The exchange method once ended at a motion that was slower all along, 40 % too slow."""
    free = past({}, limits={"tool_speed": 600})
    fastest = copy.deepcopy(free)
    del fastest["waypoints"][1]["way"]
    fastest["waypoints"][1]["after"] = "fastest"
    least = kw.plan(fastest).trajectory.duration
    assert planned(free).trajectory.duration <= 1.02 * least


@pytest.mark.exhaustive
def test_moves_heavy_load_where_arm_can_hold_it() -> None:
    """Straight motions between random configurations passed where gravity alone is too much."""
    bar = {"from": "here", "to": "there", "box": [500, 30, 30], "position": [0, 0, 16]}
    heavy = past()
    heavy["tool"]["holds"] = {"bar": bar | {"mass": 25}}
    light = past()
    light["tool"]["holds"] = {"bar": bar}
    least = planned(light).trajectory.duration
    assert past_wall().trajectory.duration < least  # what the arm holds keeps clear, too
    assert planned(heavy).trajectory.duration < 2.0 * least


@pytest.mark.exhaustive
@pytest.mark.parametrize(("at", "goal"), [(0.2, "there"), (0.3, "aside"), (0.7, "there")])
def test_replans_from_middle_of_clear_motion(at: float, goal: str) -> None:
    """It stops on its path first, and is no slower than the rest of the motion that it replaces."""
    plan = past_wall()
    task = past(start="home")
    task["waypoints"] = task["waypoints"][1:]
    if goal == "aside":
        task["waypoints"][0]["pose"] = {"position": [300, 350, 150], "rpy": DOWN}
    other = plan.replan(at, task)
    other.report.raise_if_failed()
    assert judged(other, other.scenario.task.to_dict()) == []
    for order in range(3):
        jump = plan.trajectory(at, order) - other.trajectory(0.0, order)
        assert np.abs(jump).max() <= 1e-12
    if goal == "there":
        assert other.trajectory.duration <= plan.trajectory.duration - at + 1e-3


def test_replans_from_end_of_clear_motion() -> None:
    """The arm rests there, but its velocity and acceleration are not exactly zero."""
    plan = past_wall()
    assert 0.0 < np.abs(plan.trajectory(plan.trajectory.end_time, 1)).max() < 1e-12
    back = past(waypoints=[at("there", 250), at("here", -250, way="clear")])
    plan.replan(plan.trajectory.end_time, back).report.raise_if_failed()


@pytest.mark.exhaustive
def test_keeps_torque_limits() -> None:
    given = past()
    given["limits"] = {**given["limits"], "effort": {"shoulder_lift_joint": 60}}
    assert planned(given).trajectory.duration >= past_wall().trajectory.duration


def test_released_object_blocks_next_motion() -> None:
    """The bar left across the gap is in the way back, which leads past it."""
    given = past({}, at("up", 250, 260, after=1), at("back", 250, 60, way="clear"))
    given["tool"]["holds"] = {
        "bar": {"from": "here", "to": "there", "box": [200, 30, 30], "position": [0, 0, 16]}
    }
    with pytest.raises(NoWayFoundError) as caught:
        kw.plan(given)
    assert caught.value.waypoint_index == 3
    assert "bar" in caught.value.bodies


@pytest.mark.parametrize(("room", "kept"), first_of((15, 15), (120, 60)))
def test_keeps_requested_clearance_or_a_part(room: float, kept: float) -> None:
    """Rows of the program alone once kept 2 mm where 10 mm were required."""
    given = past()
    given["waypoints"][1]["way"] = {"clear": True, "room": room}
    plan = planned(given)
    task = plan.chosen_values.scenario.task
    wider = task.replace(scene=task.scene.replace(margin=5 + kept))
    pairs = kw.check(plan.trajectory, kw.load_scenario(wider)).select(quantity="clearance")
    assert [pair.ok for pair in pairs if pair.name == "tool, wall"] == [True]
    (way,) = plan.report.select(quantity="way")
    for text in (way.message, way.highlight):
        assert f"with {kept} mm of extra clearance, minimum clearance" in text


@pytest.mark.exhaustive
def test_uses_resolution_of_check() -> None:
    given = past()
    given["collisions"] = {"resolution": 8}
    assert planned(given).report.ok


@pytest.mark.exhaustive
def test_reports_that_no_motion_was_found() -> None:
    """A wide tool would have to pass through the forearm: no other joint may turn away."""
    given = past({"crate": box([100, 100, 100], [-400, 400, 50])})
    bent = dict(zip(OUTSIDE, (0, -90, 90, -80, -90, 0), strict=True))
    given["tool"]["shape"] = {"cylinder": {"radius": 80, "length": 300}, "position": [0, 0, 200]}
    given["limits"]["position"] = {
        name: [q - 10, q + 10] for name, q in bent.items() if name != "wrist_1_joint"
    } | {"wrist_1_joint": [-85, 110]}
    given["waypoints"] = [
        {"name": "here", "joints": bent},
        {"name": "there", "joints": bent | {"wrist_1_joint": 100}, "way": "clear"},
    ]
    with pytest.raises(NoWayFoundError, match=r"waypoints\[1\].*may exist all the same") as caught:
        kw.plan(given)
    assert caught.value.bodies == ()


def test_reports_colliding_end_with_depth() -> None:
    block = {"block": box([100, 100, 100], [450, 250, 130])}
    with pytest.raises(NoWayFoundError) as caught:
        kw.plan(past(block))
    assert caught.value.waypoint_index == 1
    assert "block" in caught.value.bodies
    assert caught.value.shortfall > 0.02
    assert " mm too close to " in str(caught.value)
    assert ", and none of 12 solutions is clear;" in str(caught.value)
    study = kw.sweep(past(block), {"scene.margin": "5"}, workers=0)
    assert (study["verdict"], study["reason"]) == (["refused"], ["no way found"])


OUTSIDE = {"shoulder_pan_joint": 400} | dict.fromkeys(
    ("shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"), -90
)


def test_short_budget_gives_proved_motion() -> None:
    plan = passing_plan(past(), budget=1e-3)
    assert plan.chosen_values.duration >= past_wall().trajectory.duration


def test_gap_gradients_match_finite_differences() -> None:
    robot = kw.load_robot("panda")
    limits = robot.limits.lower, robot.limits.upper
    given = JointLimits(robot.limits.velocity, lower=limits[0], upper=limits[1])
    space = ConfigurationSpace(robot.model, build_robot_collision_model(robot), given)
    rng, step, compared = np.random.default_rng(5), 1e-5, 0
    for _ in range(20):
        q = rng.uniform(*limits)
        gaps = space.gaps(q)
        order = np.argsort(gaps, kind="stable")[:3]
        near = space.near_pairs(q, np.inf, 3)
        moves = np.eye(robot.dof) * step
        ahead, behind = (np.array([space.gaps(q + s * m)[order] for m in moves]) for s in (1, -1))
        for k, one in enumerate(near):
            slope, bend = (ahead - behind)[:, k] / (2 * step), (ahead + behind)[:, k] - 2 * one.gap
            if one.gap > 1e-3 and np.abs(bend).max() < 1e-8:  # else the nearest points jump
                assert np.abs(one.gradient - slope).max() < 1e-3
                compared += 1
    assert compared > 20
