"""Verification is independent: trajectories tampered with, and the judge's arm beside it."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from judge.arm import Arm
from judge.placing import turn_between
from knotwork import Plan, plan
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import CheckFailedError, InputError
from knotwork.task.scenario import Scenario, load_scenario
from knotwork.verification import Finding, Report, check, tool_speed_bound
from knotwork.waypoints import CartesianWaypoint

Array = NDArray[np.float64]
TURN, SLIDE = "turn", "lift"


def scenario(**rest: Any) -> Scenario:
    """Two joints from (0, 1) to (1, 0) in 2 s, from rest to rest."""
    return load_scenario(
        {
            "waypoints": [
                {"name": "A", "joints": {TURN: 0, SLIDE: 1}},
                {"name": "B", "joints": {TURN: 1, SLIDE: 0}, "after": 2},
            ],
            **rest,
        }
    )


# (3 t² - t³)/4 goes from 0 to 1 in 2 s with no speed at the ends.
RISE = np.array([-0.25, 0.75, 0.0, 0.0])


def shifted(polynomial: Array, s: float) -> Array:
    """Coefficients of p(t + s)."""
    return np.poly1d(polynomial)(np.poly1d([1.0, s])).c


def pieces(breaks: list[float], *joints: list[Array]) -> JointTrajectory:
    """A trajectory from the local polynomials of each joint, highest power first."""
    size = max(len(piece) for joint in joints for piece in joint)
    c = np.zeros((size, len(breaks) - 1, len(joints)))
    for j, joint in enumerate(joints):
        for i, piece in enumerate(joint):
            c[size - len(piece) :, i, j] = piece
    return JointTrajectory((TURN, SLIDE), PiecewisePolynomial(c, breaks))


def in_two(polynomial: Array, at: float = 1.0) -> list[Array]:
    return [polynomial, shifted(polynomial, at)]


FALL = np.array([0.25, -0.75, 0.0, 1.0])
SOUND = pieces([0, 1, 2], in_two(RISE), in_two(FALL))


def failing(report: Report) -> set[tuple[str, str]]:
    """Name and quantity of all that fails; jumps go by the quantity alone."""
    found = {
        ("" if finding.quantity.endswith("_jump") else finding.name, finding.quantity)
        for finding in report.failures
    }
    assert report.ok == (not found)
    return found


def use(report: Report, joint: str, quantity: str) -> Finding:
    (item,) = report.select(subject="joint", name=joint, quantity=quantity)
    return item


def jump(report: Report, quantity: str) -> Finding:
    (item,) = report.select(quantity=f"{quantity}_jump")
    return item


def at_waypoints(report: Report) -> tuple[Finding, ...]:
    return report.select(subject="waypoint")


def test_sound_trajectory_passes() -> None:
    report = check(SOUND, scenario(limits={"position": {TURN: [0, 1]}, "velocity": 0.75}))
    assert report.ok
    assert not report.failures
    report.raise_if_failed()
    assert len(at_waypoints(report)) == 4
    assert {item.name for item in at_waypoints(report)} == {"A", "B"}
    # 4 at the waypoints, 3 limits that are given, 3 jumps, and the time that it lasts
    assert report.counts == (11, 11)
    # The peak speed of the cubic is 3/4 at the middle, exactly at the limit.
    assert use(report, TURN, "velocity").value == pytest.approx(0.75, abs=1e-15)
    assert use(report, TURN, "velocity").time == pytest.approx(1.0)
    assert use(report, SLIDE, "velocity").limit == -0.75
    assert use(report, SLIDE, "velocity").time == pytest.approx(1.0)
    assert use(report, TURN, "jerk").limit is None
    assert use(report, TURN, "jerk").margin is None
    assert use(report, TURN, "jerk").ok


def test_names_joint_and_waypoint_of_wrong_position() -> None:
    off = RISE + np.array([0, 0, 0, 1e-3])
    report = check(pieces([0, 1, 2], in_two(off), in_two(FALL)), scenario())
    assert failing(report) == {("A", "joint_position"), ("B", "joint_position")}
    item = report.failures[0]
    assert item.value == pytest.approx(1e-3, rel=1e-9)
    assert (item.limit, item.unit, item.time) == (1e-6, "rad", 0.0)
    assert item.requested == (0.0, 1.0)
    assert item.achieved == pytest.approx((1e-3, 1.0))
    report = check(
        pieces([0, 1, 2], in_two(off), in_two(FALL)), scenario(tolerances={"joint_position": 2e-3})
    )
    assert report.ok


def broken_at_one(order: int, size: float) -> JointTrajectory:
    """The derivative of an order jumps by `size` at 1 s; the end is met all the same."""
    powers = [5, 4] if order < 2 else [4, 3]
    factor = (1.0, 1.0, 0.5)[order]
    matrix = [[1.0, 1.0], [float(power) for power in powers]]
    first, second = np.linalg.solve(matrix, [-size * factor, -size * factor * order])
    extra = np.zeros(6)
    extra[5 - powers[0]], extra[5 - powers[1]], extra[5 - order] = first, second, size * factor
    turn = [RISE, np.polyadd(shifted(RISE, 1.0), extra)]
    return pieces([0, 1, 2], turn, in_two(FALL))


def test_unrequested_continuity_is_information() -> None:
    report = check(broken_at_one(2, 1e-4), scenario(continuity=1))
    assert report.ok
    broken = jump(report, "acceleration")
    assert (broken.name, broken.time) == (TURN, 1.0)
    assert broken.value == pytest.approx(1e-4)
    assert broken.limit == pytest.approx(1e-9 * 1.5, rel=1e-3)  # of the largest acceleration
    found = report.select(group="Continuity")
    assert [finding.is_decided for finding in found] == [True, True, False]
    assert failing(check(broken_at_one(1, 1e-4), scenario(continuity=1))) == {("", "velocity_jump")}
    assert check(broken_at_one(1, 1e-4), scenario(continuity=0)).ok
    assert not check(broken_at_one(0, 1e-4), scenario(continuity=0)).ok


def test_rounding_at_rest_is_not_a_jump() -> None:
    still = scenario(
        waypoints=[
            {"joints": {TURN: 0, SLIDE: 0.3}},
            {"joints": {TURN: 1, SLIDE: 0.3}, "after": 2},
        ]
    )
    rounding = [np.array([0.0, 1e-17, 3e-17, 0.3]), np.array([0.0, -2e-17, 1e-17, 0.3])]
    assert check(pieces([0, 1, 2], in_two(RISE), rounding), still).ok


def test_too_short_trajectory_fails() -> None:
    short = pieces([0, 1], [RISE], [FALL])
    report = check(short, scenario())
    assert failing(report) == {("", "time_span")}
    (defect,) = report.failures
    assert "from 0 s to 1 s, but the waypoints run from 0 s to 2 s" in str(defect)
    late = JointTrajectory((TURN, SLIDE), PiecewisePolynomial(SOUND.polynomial.c, [0.5, 1.0, 2.0]))
    assert ("", "time_span") in failing(check(late, scenario()))
    assert failing(check(SOUND, scenario(), defects=["scratched"])) == {("", "defect")}
    with pytest.raises(InputError, match="unknown check 'colisions'; did you mean 'collisions'"):
        check(SOUND, scenario(), without=["colisions"])


def test_refuses_other_joints() -> None:
    c, x = SOUND.polynomial.c, SOUND.breaks
    with pytest.raises(InputError, match=r"lacks joint lift; .* are turn, lift"):
        check(JointTrajectory((TURN,), PiecewisePolynomial(c[:, :, :1], x)), scenario())
    with pytest.raises(InputError, match="lacks joint lift and has joint left"):
        check(JointTrajectory((TURN, "left"), PiecewisePolynomial(c, x)), scenario())
    metres = JointTrajectory((TURN, SLIDE), PiecewisePolynomial(c, x), joint_units=("rad", "m"))
    with pytest.raises(InputError, match=r"joint 'lift' in m.* rad"):
        check(metres, scenario())


def test_report_is_plain_data_and_assertion() -> None:
    report = check(broken_at_one(1, 1e-4), scenario(limits={"velocity": {SLIDE: 0.7}}))
    data = report.to_dict()
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert data["ok"] is False
    assert len(data["failures"]) == 2
    assert data["version"] == 2
    limits = [row for row in data["findings"] if row["group"] == "Joint limits"]
    assert limits[0]["name"] == TURN
    rows = [row for row in data["findings"] if row["quantity"] == "joint_position"]
    assert rows[0]["requested"] == [0.0, 1.0]
    with pytest.raises(AssertionError) as caught:
        report.raise_if_failed()
    assert isinstance(caught.value, CheckFailedError)
    assert caught.value.report is report
    for failure in report.failures:
        assert str(failure) in str(caught.value)
        assert str(failure) in data["failures"]


# With a robot, as the judge has it from the URDF.


@pytest.fixture(scope="module")
def arm() -> Arm:
    """The UR5 of the deburring scenario, as the judge reads it."""
    tool = {"frame": "tool0", "offset": {"position": [0, 0, 0.18]}}
    return Arm("ur5", Path(), tool, 1.0, 1.0, None)


def tool_errors(
    arm: Arm, trajectory: JointTrajectory, waypoint: CartesianWaypoint
) -> dict[str, float]:
    q, v = (trajectory(waypoint.time, order)[None] for order in (0, 1))
    pose, twist = arm.poses(q)[0], arm.velocities(q, v)[0]
    return {
        "position": float(np.linalg.norm(pose.translation - waypoint.position)),
        "orientation": turn_between(waypoint.rotation, pose.rotation),
        "linear_velocity": float(np.linalg.norm(twist[:3] - waypoint.linear)),
        "angular_velocity": float(np.linalg.norm(twist[3:] - waypoint.angular)),
    }


ADDED = {
    "one joint shifted": (np.s_[-1, :, 2], 1e-3),
    "one piece shifted": (np.s_[-1, 5, 1], -2e-3),
    "one piece faster": (np.s_[-2, 7, 4], 0.01),
}
"""Which coefficients become larger, and by how much."""


def tampered(trajectory: JointTrajectory, change: str) -> JointTrajectory:
    c, x = np.array(trajectory.polynomial.c), np.array(trajectory.breaks)
    if change in ADDED:
        place, amount = ADDED[change]
        c[place] += amount
    elif change == "time scaled":
        c *= (1.001 ** -np.arange(len(c) - 1.0, -1.0, -1.0))[:, None, None]
        x = x * 1.001
    elif change == "time shifted":
        x = x - 0.002
        x[-1] += 0.002
    return dataclasses.replace(
        trajectory, polynomial=PiecewisePolynomial(c, x), waypoint_times=None
    )


@pytest.mark.parametrize("change", ["nothing", *ADDED, "time scaled", "time shifted"])
def test_tool_errors_equal_pinocchio(change: str, deburring_by_waypoints: Plan, arm: Arm) -> None:
    deburring = deburring_by_waypoints
    trajectory = tampered(deburring.trajectory, change)
    report = check(trajectory, deburring.scenario)
    assert report.ok == (change == "nothing")
    tolerances = dict(deburring.scenario.tolerances)
    checked = 0
    for waypoint in deburring.scenario.waypoints:
        if not isinstance(waypoint, CartesianWaypoint):
            continue
        for quantity, error in tool_errors(arm, trajectory, waypoint).items():
            (item,) = report.select(subject="waypoint", name=waypoint.name, quantity=quantity)
            assert item.value == pytest.approx(error, rel=1e-9, abs=1e-9)
            assert item.limit == tolerances[quantity]
            assert item.ok == (item.value <= item.limit)
            checked += 1
    assert checked >= 30


def test_requested_and_achieved_poses_have_same_form(deburring: Plan) -> None:
    for item in at_waypoints(deburring.report):
        assert len(item.requested) == len(item.achieved)
        if item.quantity == "orientation":
            np.testing.assert_allclose(item.requested, item.achieved, atol=1e-6)
            assert np.linalg.norm(item.requested) == pytest.approx(1)


def test_report_has_limits_of_robot(deburring: Plan, arm: Arm) -> None:
    for i, joint in enumerate(deburring.trajectory.joint_names):
        item = use(deburring.report, joint, "velocity")
        assert abs(item.limit) == pytest.approx(arm.limits["velocity"][i])
        item = use(deburring.report, joint, "position")
        assert item.limit in arm.limits["position"][i]


def test_checks_requested_end_accelerations() -> None:
    assert not check(SOUND, scenario()).select(quantity="joint_acceleration")
    # the cubic from 0 to 1 in 2 s sets off with 6/4 and stops with -6/4
    report = check(SOUND, scenario(end_acceleration="zero"))
    assert failing(report) == {("A", "joint_acceleration"), ("B", "joint_acceleration")}
    given = {"start": {TURN: 1.5, SLIDE: -1.5}, "end": {TURN: -1.5, SLIDE: 1.5}}
    assert check(SOUND, scenario(end_acceleration=given)).ok


def test_rounding_of_end_time_is_not_a_defect() -> None:
    for end in (np.nextafter(2.0, 3.0), np.nextafter(2.0, 1.0)):
        curve = PiecewisePolynomial(SOUND.polynomial.c, np.array([0.0, 1.0, end]))
        assert check(JointTrajectory((TURN, SLIDE), curve), scenario()).ok


def test_tolerances_of_sliding_joints_are_lengths() -> None:
    task = load_scenario(
        {
            "units": {"length": "mm", "angle": "deg"},
            "joint_units": {"slide": "m"},
            "tolerances": {"joint_position": 0.5},
            "waypoints": [{"joints": {"slide": 0}}, {"joints": {"slide": 100}, "time": 2}],
        }
    )
    for off, ok in ((0.4e-3, True), (0.6e-3, False)):
        c = np.array([-0.025, 0.075, 0.0, off])[:, None, None]  # 0 to 0.1 m in 2 s, rest to rest
        moved = JointTrajectory(
            ("slide",), PiecewisePolynomial(c, np.array([0.0, 2.0])), joint_units=("m",)
        )
        report = check(moved, task)
        assert report.ok == ok
        assert at_waypoints(report)[0].limit == pytest.approx(0.5e-3)
        assert at_waypoints(report)[0].unit == "m"


def test_refuses_what_is_no_trajectory_or_scenario() -> None:
    case = plan(scenario())
    for given, says in (
        ((case.trajectory, "paper_case"), "scenario is 'paper_case'; accepted: .*kw.load_scenario"),
        ((case, case.scenario), "(?s)trajectory is .*; accepted: a kw.JointTrajectory"),
    ):
        with pytest.raises(InputError, match=says):
            check(*given)


def test_acceleration_jump_breaks_jerk_limit() -> None:
    scenario = {
        "continuity": 1,
        "planner": "cubic",
        "limits": {"jerk": 1e6},
        "waypoints": [
            {"joints": {"j": 0.0, "k": 0.0}},
            {"joints": {"j": 1.0, "k": 1.0}, "velocity": {"j": 2.0, "k": 1.0}, "after": 1},
            {"joints": {"j": 0.0, "k": 2.0}, "velocity": {"j": 0.0, "k": 1.0}, "after": 1},
        ],
    }
    report = plan(scenario).report
    jerk = use(report, "j", "jerk")
    assert not jerk.ok
    assert np.isinf(jerk.value)
    assert jerk.time == 1.0
    assert "jerk is infinite at the jump at 1 s" in str(jerk)
    data = report.to_dict()
    json.dumps(data, allow_nan=False)
    found = [row for row in data["findings"] if (row["name"], row["quantity"]) == ("j", "jerk")]
    assert found[0]["value"] is found[0]["margin"] is None
    assert found[0]["ok"] is False


def test_bound_of_speed_knows_how_far_the_tool_is_from_its_joint() -> None:
    elbow = [({}, 0.0), ({"velocity": {"elbow": 0.7}, "after": 1}, 1.0), ({"after": 0.9}, 1.2)]
    waypoints = [{**more, "joints": {"shoulder": 0, "elbow": q}} for more, q in elbow]
    made = plan({"robot": "planar2", "waypoints": waypoints})
    robot, reached = made.joints.robot, made.trajectory.extrema("velocity").peak
    fastest = np.linalg.norm(robot.jacobian([0.0, 0.0])[:3, 1]) * reached[1]
    assert fastest <= tool_speed_bound(robot, made.trajectory).bound <= 1.001 * fastest
