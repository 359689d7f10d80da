"""What is wrong with a scenario whose times are free is said with place and what is accepted."""

from __future__ import annotations

from typing import Any

import pytest

import knotwork as kw
from knotwork.errors import InputError

POSE = {"position": [0.4, 0.1, 0.4], "rpy": [0, 0, 0]}
AHEAD = {"position": [0.4, 0.2, 0.4], "rpy": [0, 0, 0]}
LIMITS = {"velocity": 2, "acceleration": 4}


def joints(*waypoints: dict[str, Any], **keys: Any) -> dict[str, Any]:
    return {"limits": LIMITS, **keys, "waypoints": [{"joints": {"a": 0}}, *waypoints]}


def poses(*waypoints: dict[str, Any], **keys: Any) -> dict[str, Any]:
    return {"robot": "ur5", "limits": LIMITS, **keys, "waypoints": [{"pose": POSE}, *waypoints]}


ONE = {"joints": {"a": 1}}

CASES = [
    (
        joints({**ONE, "after": "fast"}),
        "waypoints[1].after: 'fast': must be a positive number of seconds, fastest, or {",
    ),
    (joints({**ONE, "after": {"at_least": 1}}), "waypoints[1].after.fastest: is missing"),
    (
        joints({**ONE, "after": {"fastest": False}}),
        "waypoints[1].after.fastest: false: must be true, or left out",
    ),
    (
        joints({**ONE, "after": [1]}),
        "waypoints[1].after: [1]: must be a positive number of seconds, fastest, or {fastest: true",
    ),
    (
        {"limits": LIMITS, "waypoints": [{**ONE, "after": "fastest"}, ONE | {"after": 1}]},
        "waypoints[0].after: the first waypoint has none before it",
    ),
    (
        joints(
            {**ONE, "stop": True, "after": "fastest"}, {"joints": {"a": 2}, "time": 9}, duration=12
        ),
        "duration: is given, and the time at waypoint 3 is, too, after chosen ones (one of them",
    ),
    (
        joints(
            {**ONE, "stop": True, "after": "fastest", "name": "on"},
            {"joints": {"a": 2}, "time": 0.4, "name": "late"},
        ),
        "waypoints[2].time: 'late' is reached at ",
    ),
    (joints(ONE | {"after": 1}, times="fastest"), "times: fastest, but every waypoint gives its"),
    (
        poses({"pose": AHEAD, "along": "line", "speed": 0.1}, times="fastest"),
        "times: fastest, but every waypoint gives its time or its speed along a path (no times "
        "here, or after: fastest at a waypoint, or speed: fastest along a path",
    ),
    (joints(ONE | {"after": 1}, duration=5), "duration: is given, but every time is given too"),
    (joints(ONE | {"after": 1}, objective="jerk"), "objective: says what is minimised, but no"),
    (
        joints(ONE, times="fastest", objective="jerk"),
        "objective: does not weigh the time, so the slowest motion would be the best one (time",
    ),
    (
        joints(ONE, times="fastest", duration=5, objective="time"),
        "objective: the time is given, so it can't be made less (jerk, effort or acceleration)",
    ),
    (
        joints(ONE | {"after": 1}, knots="optimal", objective={"time": 1}),
        "objective: the time is given, so it can't be made less",
    ),
    (joints(ONE, times="fastest", objective={}), "objective: weighs nothing; give one of time"),
    (
        joints(ONE, times="fastest", duration=5, objective="effort"),
        "objective: effort needs a robot, and the file names none",
    ),
    (
        joints(ONE, times="fastest", objective={"time": 1, "power": 2}),
        "objective.power: unknown key (accepted: acceleration, effort, jerk, time)",
    ),
    (
        joints({**ONE, "velocity": "free"}, times="fastest"),
        "waypoints[1].velocity: the velocity is free at an end of the motion (a velocity, or none",
    ),
    (
        joints({**ONE, "velocity": "any"}, times="fastest"),
        "waypoints[1].velocity: 'any': must be a mapping of joint names to velocities, or free",
    ),
    (
        joints(ONE, times="fastest", knots=[0, 1]),
        "knots: times of knots are given, but those of waypoints are free (no knots)",
    ),
    (
        joints(ONE, times="fastest", planner="quintic"),
        "planner: 'quintic' takes times as they are given, and some are free (modified-hermite;",
    ),
    (
        joints(ONE, times="fastest", limits={"velocity": 2}),
        "limits: times are chosen, but nothing bounds the acceleration of a: no limit of "
        "acceleration is given; accepted: acceleration: {a: 10}",
    ),
    (
        joints(ONE, times="fastest", limits={**LIMITS, "margin": 1.5}),
        "limits.margin: 1.5: must be at most 1",
    ),
    (
        joints({"joints": {"a": 0}, "stop": True}, ONE, times="fastest"),
        "waypoints[1]: 'waypoint 1' and 'waypoint 2' are the same stop, so the least time between "
        "them is none; accepted: wait: seconds",
    ),
    (
        joints({"joints": {"a": 0}, "velocity": "free"}, ONE, times="fastest"),
        "waypoints[1]: from 'waypoint 1' to 'waypoint 2' nothing moves, so there is no least",
    ),
    (
        {
            "times": "fastest",
            "limits": LIMITS,
            "waypoints": [
                {"joints": {"a": 0, "b": 0}},
                {"joints": {"a": 1, "b": 1}, "velocity": {"a": 4, "b": 0}},
                {"joints": {"a": 2, "b": 0}},
            ],
        },
        "is given a velocity of 4 rad/s; its limit is 2 rad/s. At most 0.5 times the velocity",
    ),
    (
        joints(ONE, times="fastest", duration=0.5),
        "duration: 0.5 s is shorter than the least time found under the limits, 1",
    ),
    (
        joints(
            ONE,
            times="fastest",
            chosen=[{"times": [0, 1, 2, 3], "accelerations": {"a": [0, 0, 0, 0]}}],
        ),
        "chosen: gives the motion between waypoints, but times or speeds are free (numbers",
    ),
    (
        poses({"pose": AHEAD, "speed": {"most": 3}}, times="fastest"),
        "waypoints[1].speed.most: unknown key",
    ),
    (
        poses({"along": "line", "after": "fastest", "pose": {"position": [0.4, 0.2, 0.4]}}),
        "waypoints[1].after: the time along a path follows from its speed (speed: fastest, or",
    ),
    (
        poses(
            {
                "along": "line",
                "after": 1,
                "speed": "fastest",
                "pose": {"position": [0.4, 0.2, 0.4]},
            }
        ),
        "waypoints[1].after: is given together with a speed that is chosen (speed: fastest, or "
        "after, not",
    ),
]


@pytest.mark.parametrize(("task", "says"), CASES)
def test_it_is_said_what_is_wrong(task: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError) as caught:
        kw.plan(task)
    assert says in str(caught.value)


CHOSEN = {
    "times": [0, 0.2, 0.8, 1],
    "accelerations": {"a": [0, 7.5, -7.5, 0]},
}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"times": [0, 0.2, 1]}, "chosen[0].times: [0, 0.2, 1]: has 3 values, fewer than 4"),
        (
            {"accelerations": {"a": [0, 0, 0]}},
            "chosen[0].accelerations.a: has 3 values for 4 times (one for each time)",
        ),
        ({"accelerations": {"b": [0, 0, 0, 0]}}, "chosen[0].accelerations.b: unknown joint 'b'"),
        ({"times": [0, 0.2, 0.1, 1]}, "time of waypoint 2 is 0.1 s; it must be later than 0.2 s"),
        (
            {"times": [0, 0.2, 0.8, 1.5]},
            "run 1 begins or ends at 1.5 s, where no waypoint is; times that were chosen belong",
        ),
        (
            {"accelerations": {"a": [0, 1, -1, 0]}},
            "run 1 is for other waypoints than 'waypoint 1' and 'waypoint 2' are now: the "
            "acceleration of joint 'a' would have to change by",
        ),
        ({"velocities": {"x": {"a": 1}}}, "chosen[0].velocities.x: unknown waypoint 'x'"),
    ],
)
def test_a_chosen_run_must_fit(change: dict[str, Any], says: str) -> None:
    task = joints(ONE | {"after": 1}, chosen=[CHOSEN | change])
    with pytest.raises(InputError) as caught:
        kw.plan(task)
    assert says in str(caught.value)


def test_a_chosen_run_is_planned_as_it_says() -> None:
    made = kw.plan(joints(ONE | {"after": 1}, limits={}, chosen=[CHOSEN]))
    made.report.raise_if_failed()
    assert made.trajectory.breaks.tolist() == [0, 0.2, 0.8, 1]
