"""Motions far beyond limits fail without a search, and limits that a robot does not have."""

from __future__ import annotations

import itertools
from typing import Any

import pytest
import yaml

import knotwork as kw
from judged import with_bump
from knotwork.verification import CHECKS
from shipped import SCENARIO_FILES
from sweeps import mostly_exhaustive

MISTYPED = (1e-12, 1e-6, 1e-3, 1.5e6)
AT = {"kinova_dispense": 1, "panda_pick_place": 2, "planar2_closed_form": 2, "xarm7_bead": 1}
"""Waypoints of shipped scenarios whose `after` is mistyped."""


def shipped(name: str) -> dict[str, Any]:
    return dict(yaml.safe_load(SCENARIO_FILES[name].read_text(encoding="utf-8")))


def mistyped(name: str, after: float) -> dict[str, Any]:
    task = shipped(name)
    task["waypoints"][AT[name]]["after"] = after
    return task


@pytest.fixture
def motions(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The motions that were checked."""
    motions: list[Any] = []
    monkeypatch.setitem(CHECKS, "counted", lambda motion, *_: motions.append(motion) or ())
    return motions


@pytest.fixture
def proofs(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The proofs of clearances that were begun."""
    from knotwork.verification.bounds import clearance

    begun, own = [], clearance.clearances

    def counted(*arguments: Any) -> Any:
        begun.append(arguments)
        return own(*arguments)

    monkeypatch.setattr(clearance, "clearances", counted)
    return begun


@pytest.mark.parametrize(
    ("name", "after"),
    mostly_exhaustive(itertools.product(AT, MISTYPED), *[*zip(AT, MISTYPED, strict=True)][1::2]),
)
def test_absurd_duration_fails_without_clearance_proof(
    name: str, after: float, motions: list[Any], proofs: list[Any]
) -> None:
    report = kw.plan(mistyped(name, after)).report
    assert not report.ok
    assert any(one.group == "Joint limits" for one in report.failures)
    assert len(motions) == 1
    assert not proofs
    if name != "planar2_closed_form":  # nothing is there to collide with
        (finding,) = (one for one in report.failures if one.group == "Collisions")
        assert "collisions are not examined" in finding.message
        assert "exceeds its limit by far" in finding.message


@pytest.mark.parametrize("given", mostly_exhaustive(["approach", "edge start"], "edge start"))
def test_free_times_next_to_absurd_one_are_not_searched(given: str) -> None:
    """With rests between its waypoints the motion is hardly longer than any other."""
    task = shipped("ur5_deburring") | {"times": "fastest"}
    for one in task["waypoints"]:
        one.pop("after", None)
        one.pop("time", None)
        if one.get("name") == given:
            one["after"] = 1.5e6
    plan = kw.plan(task)
    first, _ = plan.chosen_values.sections
    assert (first.status, first.iterations) == ("resting", 0)
    assert first.trajectory.duration <= 1.001 * first.lower_bound


def test_unexamined_clearances_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the check that finds the broken limit is taken out."""
    plan = kw.plan(mistyped("kinova_dispense", 1e-3))
    monkeypatch.setitem(CHECKS, "joint_limits", lambda *_: ())
    (finding,) = kw.check(plan.trajectory, plan.scenario).select(quantity="clearance")
    assert not finding.ok


def test_waypoint_inside_object_tries_no_other_sequence(motions: list[Any]) -> None:
    task = shipped("panda_pick_place")
    task["waypoints"][3]["pose"]["position"] = [0, 0, -0.06]  # in the scales, not above
    report = kw.plan(task).report
    assert any(finding.group == "Collisions" for finding in report.failures)
    assert len(motions) == 1


ARM = kw.load_robot("ur5")
HOME = dict(zip(ARM.joint_names, ARM.configuration("home").tolist(), strict=True))
# As in a file of one's own: the URDF knows no limit of acceleration or jerk.
WITHOUT_LIMITS = {
    "name": "bare",
    "urdf": "example-robot-data:ur_description/urdf/ur5_robot.urdf",
    "base_frame": "base_link",
    "tool_frame": "tool0",
    "collision": {"ignore": [["base_link", "upper_arm_link"], ["forearm_link", "wrist_2_link"]]},
    "configurations": {"home": HOME},
}


def moved(seconds: float, **keys: Any) -> dict[str, Any]:
    """An arm turns its elbow from home."""
    turned = {**HOME, "elbow_joint": HOME["elbow_joint"] + 0.5}
    waypoints = [{"name": "there", "after": seconds, "joints": turned}]
    return {"robot": WITHOUT_LIMITS, "start": "home", "waypoints": waypoints, **keys}


def shaken(plan: kw.Plan, size: float, width: float) -> kw.JointTrajectory:
    """A motion of which one joint accelerates to and fro for a moment, by so much [rad/s², s]."""
    middle = 0.4 * plan.trajectory.duration + width / 2.0
    return with_bump(plan.trajectory, 2, middle, width / 2.0, size * (width / 4.0) ** 2 / 3.0)


@pytest.mark.parametrize(("size", "fails"), [(990.0, False), (1100.0, True)])
def test_fails_above_an_acceleration_that_no_arm_reaches(size: float, fails: bool) -> None:
    plan = kw.plan(moved(2.0))
    report = kw.check(shaken(plan, size, 0.01), plan.scenario)
    findings = report.select(quantity="acceleration_spike")
    assert len(findings) == fails
    for spike in findings:
        assert spike in report.failures
        assert spike.name == "elbow_joint"
        assert spike.value == pytest.approx(size, rel=0.02)
        assert spike.time == pytest.approx(0.805, abs=0.001)


def test_a_stated_limit_decides_instead() -> None:
    plan = kw.plan(moved(2.0, limits={"acceleration": 1200}))
    report = kw.check(shaken(plan, 1100.0, 0.01), plan.scenario)
    assert not report.select(quantity="acceleration_spike")


def test_reports_missing_limit_with_peak() -> None:
    report = kw.plan(moved(2.0)).report
    (finding,) = report.select(quantity="missing_limits")
    peaks = []
    for quantity, unit in (("acceleration", "rad/s²"), ("jerk", "rad/s³")):
        (joint,) = report.select(subject="joint", name="elbow_joint", quantity=quantity)
        assert joint.value is not None
        peaks.append(
            f"{quantity} (peak {abs(joint.value):.4g} {unit}, elbow_joint at {joint.time:.6g} s)"
        )
    assert finding.message == f"bare: no limit is known of {', '.join(peaks)}"
    assert "  No limit known " in str(report)


def test_stated_limits_are_not_reported_as_missing() -> None:
    plan = kw.plan(moved(2.0, limits={"acceleration": 10, "jerk": 100}))
    assert not plan.report.select(quantity="missing_limits")
    some = kw.plan(moved(2.0, limits={"acceleration": {"elbow_joint": 10}, "jerk": 100}))
    (finding,) = some.report.select(quantity="missing_limits")
    assert "acceleration of shoulder_pan_joint, shoulder_lift_joint, wrist_1_joint" in str(finding)


def test_warns_of_chosen_times_without_acceleration_limit() -> None:
    task = moved(2.0, times="fastest")
    del task["waypoints"][0]["after"]
    (found,) = kw.plan(task).report.warnings
    assert str(found).startswith(
        "times are chosen, but no acceleration limit is known for bare: only effort bounds it"
    )
    given = kw.plan(task | {"limits": {"acceleration": 10}})
    assert not given.report.warnings
