"""A plan while it runs: its laws, with closed forms and samples of an independent composition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import knotwork as kw
from knotwork.errors import InputError

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


@pytest.fixture(scope="module")
def deburring() -> kw.Plan:
    task = kw.Task.load("ur5_deburring")
    limits = task.limits.replace(acceleration=150, jerk=1500)
    return kw.plan(task.replace(limits=limits))


def test_an_override_stays_on_the_path(deburring: kw.Plan) -> None:
    slow = deburring.scaled({0: 1.0, 2: 0.3, 4: 1.0})
    assert slow.report.ok
    assert slow.trajectory.continuity.order >= 2
    assert slow.trajectory.polynomial.degree == 3
    time = np.linspace(0, slow.trajectory.end_time, 4001)
    # the clock by quadrature of the override, whose shape is two parabolas a change
    u = np.clip(time / 2, 0, 2)
    part = np.where(u < 1, u, 2 - u)
    level = np.where(part < 0.5, 2 * part**2, 1 - 2 * (1 - part) ** 2)
    rate = np.where(time < 4, 1 - 0.7 * level, 1.0)
    clock = np.concatenate(([0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))))
    clock = np.minimum(clock, deburring.trajectory.end_time)
    gap = slow.trajectory.position(time) - deburring.trajectory.position(clock)
    assert np.abs(gap).max() < 3e-6
    assert slow.trajectory.duration == pytest.approx(13 + 1.4, abs=1e-9)
    names = {one.name for one in deburring.scenario.waypoints}
    assert {one.name for one in slow.scenario.waypoints} == names


@example(speed=1.21875, part=0.796875)
@given(st.floats(0.2, 1.5), st.floats(0.2, 1.0))
def test_the_shortest_stop_of_even_motion_is_nearly_the_closed_form(
    speed: float, part: float
) -> None:
    plan = swing(speed)
    stop = plan.stop(2.0 + 5 * part)
    shortest = speed / 4 + 4 / 40 if speed >= 16 / 40 else 2 * np.sqrt(speed / 40)
    assert shortest * (1 - 1e-9) <= stop.trajectory.duration <= 1.004 * shortest
    assert stop.report.ok
    free = plan.stop(2.0 + 5 * part, on_path=False)
    assert free.trajectory.duration == pytest.approx(shortest, rel=1e-9)
    assert free.report.ok


@pytest.mark.parametrize("at", [0.7, 3.0, 4.9, 8.0, 12.0])
@pytest.mark.parametrize("on_path", [True, False])
def test_a_stop_keeps_state_limits_and_path(deburring: kw.Plan, at: float, on_path: bool) -> None:
    stop = deburring.stop(at, on_path=on_path)
    was, now = deburring.trajectory, stop.trajectory
    for nu in range(3):
        assert np.abs(now(0.0, nu) - was(at, nu)).max() < 1e-12
    for nu in (1, 2):
        assert np.abs(now(now.end_time, nu)).max() < 1e-10
    space = deburring.space
    for kind in ("acceleration", "jerk"):
        peak = now.extrema(kind).peak
        assert (peak <= space.limits[kind] * (1 + 1e-9)).all()
    if on_path:
        places = was.position(np.linspace(at, min(at + now.duration, was.end_time), 20001))
        for q in now.position(np.linspace(0, now.end_time, 20)):
            assert np.abs(places - q).max(axis=1).min() < 1e-5
    else:
        assert now.duration <= deburring.stop(at).trajectory.duration * (1 + 1e-9)


def test_another_goal_goes_on_without_a_jump(deburring: kw.Plan) -> None:
    goal = deburring.scenario.task
    home = [{"joints": "home"}, {"joints": "home", "after": "fastest"}]
    other = kw.Task(robot="ur5", units={"angle": "deg"}, limits=goal.limits, waypoints=home)
    after = deburring.replace(8.0, other)
    assert after.report.ok
    for nu in range(3):
        jump = after.trajectory(0.0, nu) - deburring.trajectory(8.0, nu)
        assert np.abs(jump).max() <= 1e-12
    assert np.abs(after.trajectory(after.trajectory.end_time, 1)).max() < 1e-10


@pytest.mark.parametrize(
    ("profile", "words"),
    [
        ({}, "no values"),
        ({0: -0.5}, "override -0.5"),
        ({-1: 1.0}, "time -1"),
        ({0: float("nan")}, "nan"),
        ({0: 0.0}, "nothing would move"),
    ],
)
def test_profiles_that_mean_nothing(profile: dict[float, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        swing().scaled(profile)


def test_stops_that_do_not_exist() -> None:
    with pytest.raises(InputError, match="15"):
        swing().stop(15.0)
    joints = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 2}]
    with pytest.raises(InputError, match="no limit of acceleration"):
        kw.plan({"waypoints": joints}).stop(1.0)
    half = kw.plan({"limits": {"acceleration": 4}, "waypoints": joints})
    with pytest.raises(InputError, match="no limit of jerk"):
        half.stop(1.0, on_path=False)
    calm = {"limits": LIMITS, "end_acceleration": "zero", "waypoints": joints}
    with pytest.raises(InputError, match="stands still"):
        kw.plan(calm).stop(2.0, on_path=False)
