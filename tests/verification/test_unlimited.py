"""What no limit forbids: limits that a robot does not have, and peaks out of proportion."""

from __future__ import annotations

from math import factorial
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

import knotwork as kw
from judge.cases import bumped
from judge.motion import Motion
from judged import judged
from knotwork.verification import Finding
from sweeps import examples

ARM = kw.load_robot("ur5")
TURNED = dict(zip(ARM.joint_names, ARM.configuration("home").tolist(), strict=True))
TURNED["elbow_joint"] += 0.5


# As in a file of one's own: the URDF knows no limit of acceleration or jerk.
WITHOUT_LIMITS = {
    "name": "bare",
    "urdf": "example-robot-data:ur_description/urdf/ur5_robot.urdf",
    "base_frame": "base_link",
    "tool_frame": "tool0",
    "collision": {"ignore": [["base_link", "upper_arm_link"], ["forearm_link", "wrist_2_link"]]},
    "configurations": {
        "home": dict(zip(ARM.joint_names, ARM.configuration("home").tolist(), strict=True))
    },
}


def moved(seconds: float, **keys: Any) -> dict[str, Any]:
    """An arm turns its elbow from home."""
    waypoints = [{"name": "there", "after": seconds, "joints": TURNED}]
    return {"robot": WITHOUT_LIMITS, "start": "home", "waypoints": waypoints, **keys}


def shaken(plan: kw.Plan, size: float, width: float) -> kw.JointTrajectory:
    """A motion of which one joint accelerates to and fro for a moment, by so much [rad/s², s]."""
    curve, made = plan.trajectory.polynomial, plan.trajectory
    knots = 0.4 * made.duration + width / 4.0 * np.arange(5)
    bump = BSpline.basis_element(knots, extrapolate=False)
    x = np.unique(np.concatenate((curve.x, knots)))
    left = x[:-1]
    c = []
    for order in (3, 2, 1, 0):
        values = curve(left, order)
        shape = np.where((left < knots[0]) | (left >= knots[-1]), 0.0, bump(left, order))
        values[:, 2] += size * (width / 4.0) ** 2 / 2.0 * shape
        c.append(values / factorial(order))
    return kw.JointTrajectory(
        made.joint_names, kw.PiecewisePolynomial(np.array(c), x), joint_units=made.joint_units
    )


def test_acceleration_spike_is_in_short_report() -> None:
    plan = kw.plan(moved(2.0))
    report = kw.check(shaken(plan, 100.0, 0.01), plan.scenario)
    (found,) = report.warnings
    assert (found.quantity, found.name, report.ok) == ("acceleration_spike", "elbow_joint", True)
    assert found.value == pytest.approx(100.0, rel=0.02)
    assert found.time == pytest.approx(0.805, abs=0.001)
    assert (
        str(report)
        .splitlines()[1]
        .startswith("warning: joint 'elbow_joint': acceleration peaks at ")
    )


def test_harmful_spike_fails() -> None:
    plan = kw.plan(moved(2.0))
    report = kw.check(shaken(plan, 1100.0, 0.01), plan.scenario)
    (found,) = report.select(quantity="acceleration_spike")
    assert found in report.failures


def test_jerk_spike_is_in_short_report() -> None:
    """Its acceleration is no larger than what the motion needs."""
    plan = kw.plan(moved(2.0))
    report = kw.check(shaken(plan, 0.5, 0.004), plan.scenario)
    (found,) = report.warnings
    assert (found.quantity, found.name, report.ok) == ("jerk_spike", "elbow_joint", True)
    assert found.value == pytest.approx(750.0, rel=0.02)
    assert found.time == pytest.approx(0.8, abs=0.01)
    assert "warning: joint 'elbow_joint': jerk peaks at " in str(report).splitlines()[1]


@pytest.mark.parametrize(("size", "width"), [(100.0, 0.2), (0.9, 0.05), (0.05, 0.004)])
def test_sustained_or_small_peak_is_not_a_spike(size: float, width: float) -> None:
    plan = kw.plan(moved(2.0))
    assert not spikes(kw.check(shaken(plan, size, width), plan.scenario))


@pytest.mark.parametrize(
    ("width", "height"),
    [(0.005, 0.005), (0.012, 0.015), (0.015, 0.015), (0.02, 0.01), (0.02, 0.025), (0.03, 0.04)],
)
@pytest.mark.parametrize("middles", [(1.4,), (1.4, 2.0, 2.6)])
def test_finds_spikes_of_any_width_and_number(
    width: float, height: float, middles: tuple[float, ...]
) -> None:
    """What is kept up is no more than what positions a while apart tell of."""
    plan = kw.plan("ur5_deburring")
    made = plan.trajectory
    motion = Motion(made.joint_names, made.polynomial.x, made.polynomial.c)
    for middle in middles:
        motion = bumped(motion, 5, middle, width, height)
    curve = kw.PiecewisePolynomial(motion.c, motion.x)
    spoiled = kw.JointTrajectory(made.joint_names, curve, joint_units=made.joint_units)
    report = kw.check(spoiled, plan.scenario)
    (found,) = report.select(quantity="acceleration_spike")
    assert found.name == made.joint_names[5]
    assert found.value == pytest.approx(12.0 * height / width**2, rel=0.02)
    assert found.limit is not None
    assert found.limit < 0.6 * found.value


def spikes(report: kw.Report) -> list[Finding]:
    return [*report.select(quantity="acceleration_spike"), *report.select(quantity="jerk_spike")]


@given(
    planner=st.sampled_from(["modified-hermite", "cubic", "quintic", "septic"]),
    power=st.floats(-2.0, 2.0),
    moves=st.lists(st.tuples(st.floats(1.0, 5.0), st.floats(-2.0, 2.0)), min_size=3, max_size=3),
    wait=st.booleans(),
)
@examples(12)
def test_ordinary_motions_have_no_spike(
    planner: str, power: float, moves: list[tuple[float, float]], wait: bool
) -> None:
    """Moves of 10 ms to 8 min, at once or after a wait a hundred times as long."""
    waypoints: list[dict[str, Any]] = [{"joints": {"a": 0.0}}]
    for seconds, position in moves:
        stop = {"stop": True} if len(waypoints) < len(moves) else {}
        waypoints.append({"after": seconds * 10.0**power, "joints": {"a": position}, **stop})
    if wait and planner == "modified-hermite":
        waypoints[1] |= {"wait": 100.0 * 10.0**power}
    task = {"planner": planner, "waypoints": waypoints}
    plan = kw.plan(task)
    assert not spikes(plan.report)
    assert judged(plan, task) == []


@pytest.mark.parametrize("planner", ["cubic", "septic"])
@pytest.mark.parametrize("seconds", [0.02, 0.2, 2.0])
def test_single_move_has_no_spike(planner: str, seconds: float) -> None:
    """Its peak is all that the motion does."""
    assert not spikes(kw.plan(moved(seconds, planner=planner)).report)


@pytest.mark.parametrize("quick", [0.02, 0.05, 0.2])
@pytest.mark.parametrize("second", [0.001, 1.0])
def test_quick_moves_around_long_wait_have_no_spike(quick: float, second: float) -> None:
    """Though the second may be next to nothing."""
    waypoints: list[dict[str, Any]] = [
        {"joints": {"a": 0.0}},
        {"after": quick, "joints": {"a": 1.0}, "stop": True, "wait": 60.0},
        {"after": quick, "joints": {"a": 1.0 + second}},
    ]
    assert not spikes(kw.plan({"waypoints": waypoints}).report)


@pytest.mark.parametrize("wait", [1e4, 1e6])
def test_long_motion_of_short_moves_has_no_spike(wait: float) -> None:
    """However far apart samples of the whole motion are."""
    task: dict[str, Any] = {
        "limits": {"velocity": 3, "acceleration": 20, "jerk": 8000},
        "times": "fastest",
        "waypoints": [
            {"joints": {"a": 0.0}},
            {"joints": {"a": 1.0}, "stop": True, "wait": wait},
            {"joints": {"a": -0.5}},
        ],
    }
    report = kw.plan(task).report
    assert report.ok
    assert not spikes(report)


def test_reports_missing_limit_with_peak() -> None:
    report = kw.plan(moved(2.0)).report
    (found,) = report.select(quantity="missing_limits")
    peaks = []
    for quantity, unit in (("acceleration", "rad/s²"), ("jerk", "rad/s³")):
        (joint,) = report.select(subject="joint", name="elbow_joint", quantity=quantity)
        assert joint.value is not None
        peaks.append(
            f"{quantity} (peak {abs(joint.value):.4g} {unit}, elbow_joint at {joint.time:.6g} s)"
        )
    assert found.message == f"no limit is known for bare of {', '.join(peaks)}"
    assert "  No limit known " in str(report)


def test_stated_limits_are_not_reported_as_missing() -> None:
    plan = kw.plan(moved(2.0, limits={"acceleration": 10, "jerk": 100}))
    assert not plan.report.select(quantity="missing_limits")
    some = kw.plan(moved(2.0, limits={"acceleration": {"elbow_joint": 10}, "jerk": 100}))
    (found,) = some.report.select(quantity="missing_limits")
    assert "acceleration of shoulder_pan_joint, shoulder_lift_joint, wrist_1_joint" in str(found)


def test_warns_of_chosen_times_without_acceleration_limit() -> None:
    task = moved(2.0, times="fastest")
    del task["waypoints"][0]["after"]
    (found,) = kw.plan(task).report.warnings
    assert str(found).startswith(
        "times are chosen, but no acceleration limit is known for bare: only torque bounds it"
    )
    given = kw.plan(task | {"limits": {"acceleration": 10}})
    assert not given.report.warnings
