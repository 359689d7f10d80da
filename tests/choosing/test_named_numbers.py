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
        assert "'q' takes more than" in said
        made = kw.plan(passing(number(said, "; with")))
        made.report.raise_if_failed()


def test_a_time_that_the_speed_of_the_tool_makes_too_short() -> None:
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


def test_a_joint_that_moves_at_its_position_limit_has_its_least_room_named() -> None:
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


def points(*rows: list[float]) -> list[dict[str, Any]]:
    return [
        {"name": f"w{i}", "joints": dict(zip("abc", row, strict=False))}
        for i, row in enumerate(rows)
    ]


def limits(**rows: list[float]) -> dict[str, Any]:
    return {name: dict(zip("abc", row, strict=False)) for name, row in rows.items()}


def test_times_that_are_named_for_several_intervals_can_be_taken_together() -> None:
    via = [{"velocity": {"a": 0.686}, "after": 0.55}, {"velocity": {"a": -0.646}}]
    start, *inner, end = points([0.937], [0.362], [-0.101], [0.69])
    end["after"] = 0.116
    for point, more in zip(inner, via, strict=True):
        point.update(more)
    asked = task(limits=limits(velocity=[0.722], acceleration=[4.162], jerk=[8.603]))
    asked["waypoints"] = [start, *inner, end]
    first, second = refusal(asked).splitlines()
    inner[0]["after"], end["after"] = (number(line, "; with") for line in (first, second))
    assert kw.plan(asked).report.ok


def test_speeds_and_times_are_told_together_and_do_together() -> None:
    """Two of each in the first run, and a time after the wait."""

    def asked(speeds: list[float], times: list[float]) -> dict[str, Any]:
        start, *inner, end = points([0.0], [1.0], [2.0], [2.8], [3.8], [3.5])
        for point, v in zip(inner, (*speeds, 0.0, 0.3), strict=True):
            point.update({"velocity": {"a": v}} if v else {"stop": True, "wait": 0.5})
        inner[0]["after"], inner[1]["after"], inner[3]["after"] = times
        return task(limits=LIMITS) | {"waypoints": [start, *inner, end]}

    said = refusal(asked([3.0, -1.7], [0.4, 0.5, 1.0]))
    lines = said.splitlines()
    assert len(lines) == 5
    factors = [float(one) for one in re.findall(r"most ([0-9.]+) times the velocity given", said)]
    times = [number(line, "; with") for line in lines if " s are given" in line]
    made = kw.plan(asked([3.0 * factors[0], -1.7 * factors[1]], times))
    made.report.raise_if_failed()
    assert made.scenario.times[1] == pytest.approx(times[0])


def test_a_speed_and_a_time_at_a_pose_do_together() -> None:
    def passing(speed: float, after: float) -> dict[str, Any]:
        def pose(y: float) -> dict[str, Any]:
            return {"pose": {"position": [400, y, 300], "rpy": [180, 0, 0]}}

        via = {"name": "via", **pose(0), "speed": speed, "after": after}
        bounds = {"acceleration": 400, "velocity": {"shoulder_pan_joint": 40}}
        units = {"length": "mm", "angle": "deg"}
        ends = {"robot": "ur5", "units": units, "limits": bounds, "times": "fastest"}
        return {**ends, "waypoints": [pose(-300), via, pose(300)]}

    said = refusal(passing(900, 0.2))
    factor = re.search(r"'via'.* At most ([0-9.]+) times the velocity given here", said)
    assert factor, said
    assert kw.plan(passing(900 * float(factor[1]), number(said, "; with"))).report.ok


def test_speeds_beyond_that_of_the_tool_are_reported_and_then_times_that_are_too_short() -> None:
    """Along a path and at a waypoint, each before a time that is too short."""

    def asked(along: float, past: float, *times: float) -> dict[str, Any]:
        def pose(name: str, y: float, z: float, **keys: Any) -> dict[str, Any]:
            place = {"position": [400, y, z], "rpy": [180, 0, 0]}
            return {"name": name, "pose": place, "after": "fastest", **keys}

        end = {"name": "b", "along": "line", "pose": {"position": [400, 0, 300]}, "speed": along}
        start = {"name": "a", "pose": {"position": [400, -200, 300], "rpy": [180, 0, 0]}}
        return {
            "robot": "ur5",
            "units": {"length": "mm", "angle": "deg"},
            "limits": {"velocity": 90, "acceleration": 400, "tool_speed": 300},
            "branch": {"shoulder": "left", "elbow": "up", "wrist": "flip"},
            "waypoints": [
                start,
                end,
                pose("c", 200, 300, after=times[0], stop=True),
                pose("d", 250, 400, stop=True),
                pose("e", 250, 500, speed=past),
                pose("f", 250, 600, after=times[1], stop=True),
            ],
        }

    said = refusal(asked(500, 800, 0.2, 0.3))
    speeds = [float(one) for one in re.findall(r"accepted: (?:at most )?([0-9.]+) mm/s", said)]
    assert len(speeds) == 2, said
    times = refusal(asked(*speeds, 0.2, 0.3)).splitlines()
    assert len(times) == 2, times
    assert all(" takes more than" in line for line in times), times
    assert kw.plan(asked(*speeds, 2.0, 2.0)).report.ok


def test_a_speed_and_then_a_duration_that_are_named_can_be_taken() -> None:
    def asked(speed: float, duration: float) -> dict[str, Any]:
        via = {"name": "b", "joints": {"q": 1}, "velocity": {"q": speed}}
        return task(via, {"name": "c", "joints": {"q": 2}}, duration=duration)

    speed = refusal(asked(1.5, 1))
    factor = re.search(r"([0-9.]+) times the velocity given", speed)
    assert factor, speed
    possible = 1.5 * float(factor[1])
    total = refusal(asked(possible, 1))
    assert "duration: 1 s is shorter than the least time" in total
    kw.plan(asked(possible, number(total, "accepted:"))).report.raise_if_failed()


def test_times_to_which_only_a_motion_with_longer_ones_leads() -> None:
    places = points(
        [-0.367, -0.421, 0.236],
        [0.254, -0.775, 0.075],
        [0.451, 0.549, -0.665],
        [-0.199, -0.016, 0.96],
        [0.847, -0.132, -0.37],
    )
    places[1] |= {"velocity": "free", "after": 0.814}
    places[2] |= {"velocity": "free", "after": 1.056}
    places[3]["stop"] = True
    places[4]["after"] = 1.107
    bounds = limits(
        velocity=[1.686, 1.792, 1.318],
        acceleration=[24.074, 11.7, 18.067],
        jerk=[73.555, 84.102, 728.201],
    )
    assert kw.plan(task(limits=bounds) | {"waypoints": places}).report.ok


def test_the_smoothest_motion_that_lasts_hardly_longer_than_the_fastest() -> None:
    places = points([-0.985, -0.439], [-0.57, 0.151], [0.093, -0.243], [0.256, 0.926])
    places += [{"name": "end", "joints": {"a": 0.894, "b": -0.252}, "after": 1.857}]
    places[1]["stop"] = True
    places[2]["velocity"] = {"a": -0.112, "b": 0.68}
    places[3]["velocity"] = {"a": -2.4619749, "b": -0.1976556}
    bounds = limits(velocity=[2.462, 0.709], acceleration=[10.053, 3.66], jerk=[557.8, 158.011])
    asked = task(limits=bounds, duration=5.85, objective="jerk") | {"waypoints": places}
    made = kw.plan(asked)
    assert made.report.ok
    assert made.trajectory.duration == pytest.approx(5.85)


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
        assert made.chosen.objective[f"peak_{kind}"] == pytest.approx(peak, rel=1e-12)


def test_a_peak_is_traded_for_time_and_frozen(tmp_path: Path) -> None:
    end, limits = (
        {"name": "b", "joints": {"q": 1}},
        {"velocity": 9, "acceleration": 90, "jerk": 900},
    )
    calm = kw.plan(task(end, limits=limits, objective={"time": 1, "peak_jerk": 0.1}))
    # T + w 32 / T³ is least where T⁴ = 96 w
    best = (96 * 0.1) ** 0.25
    cost = calm.trajectory.duration + 0.1 * calm.chosen.objective["peak_jerk"]
    assert cost == pytest.approx(best + 0.1 * 32 / best**3, rel=1e-3)
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
    most = number(said, "takes less than")
    assert kw.plan(through(times="fastest", duration=0.98 * most)).report.ok


def test_a_time_between_passing_and_stopping_under_a_limit_of_jerk() -> None:
    task = through(knots="optimal", end_acceleration="zero")
    task["limits"] = {"velocity": 3, "acceleration": 0.1, "jerk": 0.1}
    task["waypoints"][1]["after"] = 1.02
    said = refusal(task)
    task["waypoints"][1]["after"] = number(said, "; with")
    assert kw.plan(task).report.ok
