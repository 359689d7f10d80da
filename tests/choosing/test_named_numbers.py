"""A number that a refusal names can be taken: with it the motion is planned."""

from __future__ import annotations

import re
from typing import Any

import pytest

import knotwork as kw
from knotwork.errors import InputError

LIMITS = {"velocity": 1, "acceleration": 2, "jerk": 20}


def task(*waypoints: dict[str, Any], **keys: Any) -> dict[str, Any]:
    start = {"name": "a", "joints": {"q": 0}}
    return {"times": "fastest", "limits": LIMITS, "waypoints": [start, *waypoints], **keys}


def refusal(of: dict[str, Any]) -> str:
    with pytest.raises(InputError) as raised:
        kw.plan(of)
    return str(raised.value)


def number(said: str, before: str) -> float:
    found = re.search(before + r" ([0-9.]+) s", said)
    assert found, said
    return float(found[1])


def test_named_duration_is_feasible() -> None:
    end = {"name": "b", "joints": {"q": 1}}
    named = number(refusal(task(end, duration=0.5)), "accepted:")
    made = kw.plan(task(end, duration=named))
    assert made.trajectory.duration == pytest.approx(named)
    assert named < 1.002 * kw.plan(task(end)).trajectory.duration


def test_named_time_is_feasible_with_joint_and_limit() -> None:
    def passing(after: float) -> dict[str, Any]:
        via = {"name": "b", "joints": {"q": 1}, "velocity": {"q": 0.5}, "after": after}
        return task(via, {"name": "c", "joints": {"q": 2}})

    for given in (0.8, 1.37):
        said = refusal(passing(given))
        assert "'q' takes more than" in said
        made = kw.plan(passing(number(said, "; with")))
        made.report.raise_if_failed()


def test_names_time_bounded_by_tool_speed() -> None:
    turned = {"name": "b", "joints": {"shoulder": 1.5, "elbow": 1.2}, "after": 1.2}
    across = {
        "robot": "planar2",
        "start": "home",
        "knots": "optimal",
        "limits": {"tool_speed": 0.5},
        "waypoints": [turned],
    }
    said = refusal(across)
    assert "the tool, on the straight line, takes more than" in said
    turned["after"] = number(said, "; with")
    kw.plan(across).report.raise_if_failed()


def test_names_braking_distance_at_position_limit() -> None:
    def at(q: float) -> dict[str, Any]:
        turn = {"name": "b", "joints": {"q": q}, "velocity": {"q": 0.2}}
        limits = {**LIMITS, "jerk": 2000, "position": {"q": [-0.1, 1]}}
        return {**task(turn, {"name": "c", "joints": {"q": 0}}), "limits": limits}

    said = refusal(at(1.0))
    assert "can't stop before its position limit, 0 rad away" in said
    assert "No part of the velocity given here is possible" in said
    found = re.search(r"needs at least ([0-9.]+) rad", said)
    assert found, said
    kw.plan(at(1.0 - 1.05 * float(found[1]))).report.raise_if_failed()


def through(**keys: Any) -> dict[str, Any]:
    ends = [{"joints": {"q": q}, "velocity": {"q": 1}, "name": n} for q, n in ((0, "a"), (1, "b"))]
    return {"limits": {"velocity": 3, "acceleration": 0.1}, **keys, "waypoints": ends}
