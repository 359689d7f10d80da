"""A number that a refusal names can be taken: with it the motion is planned."""

from __future__ import annotations

import re
from pathlib import Path
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


def test_a_duration_that_is_named_can_be_taken() -> None:
    end = {"name": "b", "joints": {"q": 1}}
    named = number(refusal(task(end, duration=0.5)), "accepted:")
    made = kw.plan(task(end, duration=named))
    assert made.trajectory.duration == pytest.approx(named)
    assert named < 1.002 * kw.plan(task(end)).trajectory.duration


def test_a_time_that_is_named_can_be_taken_and_its_joint_and_limit_are_said() -> None:
    def passing(after: float) -> dict[str, Any]:
        via = {"name": "b", "joints": {"q": 1}, "velocity": {"q": 0.5}, "after": after}
        return task(via, {"name": "c", "joints": {"q": 2}})

    for given in (0.8, 1.37):
        said = refusal(passing(given))
        assert "'q' at its limit of " in said
        made = kw.plan(passing(number(said, "it takes about")))
        made.report.raise_if_failed()


def test_the_least_peaks_are_those_of_the_closed_form() -> None:
    """From stop to stop in T by D: jerk up, down and up again, or acceleration up and down."""
    end = {"name": "b", "joints": {"q": 1}, "after": 2}
    limits = {"velocity": 9, "acceleration": 90, "jerk": 9000}
    given = {"knots": "optimal", "times": None, "limits": limits, "end_acceleration": "zero"}
    for kind, least in (("jerk", 32 / 2**3), ("acceleration", 4 / 2**2)):
        wanted = task(end, **given, objective=f"peak_{kind}")
        made = kw.plan({key: value for key, value in wanted.items() if value is not None})
        made.report.raise_if_failed()
        peak = made.trajectory.extrema(kind).peak[0]
        assert least <= peak < 1.01 * least
        assert made.chosen.objective[f"peak_{kind}"] == peak


def test_a_peak_is_traded_for_time_and_frozen(tmp_path: Path) -> None:
    end, limits = (
        {"name": "b", "joints": {"q": 1}},
        {"velocity": 9, "acceleration": 90, "jerk": 900},
    )
    calm = kw.plan(task(end, limits=limits, objective={"time": 1, "peak_jerk": 0.1}))
    # T + w 32 / T³ is least where T⁴ = 96 w
    assert calm.trajectory.duration == pytest.approx((96 * 0.1) ** 0.25, rel=0.01)
    again = kw.plan(calm.freeze(tmp_path / "frozen.yaml"))
    for name in "xc":
        before, after = (getattr(one.trajectory.polynomial, name) for one in (calm, again))
        assert before.tobytes() == after.tobytes()


def through(**keys: Any) -> dict[str, Any]:
    ends = [{"joints": {"q": q}, "velocity": {"q": 1}, "name": n} for q, n in ((0, "a"), (1, "b"))]
    return {"limits": {"velocity": 3, "acceleration": 0.1}, **keys, "waypoints": ends}


def test_a_duration_in_which_a_joint_would_have_to_wait() -> None:
    said = refusal(through(times="fastest", duration=5))
    assert "can't wait" in said
    least = re.search(r"([0-9.]+) s, the least", said)
    assert least, said
    assert kw.plan(through(times="fastest", duration=float(least[1]))).report.ok


def test_a_time_between_passing_and_stopping_under_a_limit_of_jerk() -> None:
    task = through(knots="optimal", end_acceleration="zero")
    task["limits"] = {"velocity": 3, "acceleration": 0.1, "jerk": 0.1}
    task["waypoints"][1]["after"] = 1.02
    said = refusal(task)
    task["waypoints"][1]["after"] = number(said, "in passing it takes")
    assert kw.plan(task).report.ok
