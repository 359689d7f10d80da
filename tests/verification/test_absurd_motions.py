"""One mistyped number does not cost minutes: what is hopeless is told without a search."""

from __future__ import annotations

import itertools
from typing import Any

import pytest
import yaml

import knotwork as kw
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
    made: list[Any] = []
    monkeypatch.setitem(CHECKS, "counted", lambda motion, *_: made.append(motion) or ())
    return made


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
        (said,) = (one for one in report.failures if one.group == "Collisions")
        assert "collisions are not examined" in said.message
        assert "is far beyond its limit" in said.message


@pytest.mark.parametrize("given", ["approach", "edge start"])
def test_free_times_next_to_absurd_one_are_not_searched(given: str) -> None:
    """With rests between its waypoints the motion is hardly longer than any other."""
    task = shipped("ur5_deburring") | {"times": "fastest"}
    for one in task["waypoints"]:
        one.pop("after", None)
        one.pop("time", None)
        if one.get("name") == given:
            one["after"] = 1.5e6
    plan = kw.plan(task)
    assert plan.chosen is not None
    first, _ = plan.chosen.segments
    assert (first.status, first.iterations) == ("resting", 0)
    assert first.trajectory.duration <= 1.001 * first.lower_bound


def test_unexamined_clearances_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the check that finds the broken limit is taken out."""
    plan = kw.plan(mistyped("kinova_dispense", 1e-3))
    monkeypatch.setitem(CHECKS, "joint_limits", lambda *_: ())
    (said,) = kw.check(plan.trajectory, plan.scenario).select(quantity="clearances")
    assert not said.ok


def test_waypoint_inside_object_tries_no_other_sequence(motions: list[Any]) -> None:
    task = shipped("panda_pick_place")
    task["waypoints"][3]["pose"]["position"] = [0, 0, -0.06]  # in the scales, not above
    report = kw.plan(task).report
    assert any(one.group == "Collisions" for one in report.failures)
    assert len(motions) == 1
