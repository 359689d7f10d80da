"""Stops on the path are the shortest there are: against other formulations of the problem."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

import knotwork as kw
from knotwork.curves.retiming import stop_joints, stop_on_path
from knotwork.errors import InputError
from knotwork.joint_quantities import JointLimits
from sweeps import mostly_exhaustive

INTERVALS = 100
FloatArray = npt.NDArray[np.float64]


def by_collocation(
    c: FloatArray, at: float, acceleration: FloatArray, jerk: FloatArray, guess: float
) -> float:
    """The least duration of a stop on a curve of one piece: all states are unknowns of IPOPT."""
    opti = ca.Opti()
    length = opti.variable()
    shown, rate, change = (opti.variable(INTERVALS + 1) for _ in range(3))
    bend = opti.variable(INTERVALS)
    h = length / INTERVALS
    a, b = slice(0, INTERVALS), slice(1, INTERVALS + 1)
    opti.subject_to(change[b] == change[a] + h * bend)
    opti.subject_to(rate[b] == rate[a] + h * change[a] + h**2 / 2 * bend)
    opti.subject_to(shown[b] == shown[a] + h * rate[a] + h**2 / 2 * change[a] + h**3 / 6 * bend)
    opti.subject_to([shown[0] == at, rate[0] == 1, change[0] == 0])
    opti.subject_to([rate[-1] == 0, change[-1] == 0, length >= 1e-3])
    opti.subject_to(opti.bounded(0, rate, 1))
    for end in (a, b):
        s, s1 = rate[end], change[end]
        for i in range(c.shape[1]):
            q1, q2, q3 = (
                sum(float(k) * shown[end] ** n for n, k in enumerate(np.polyder(c[:, i], nu)[::-1]))
                for nu in (1, 2, 3)
            )
            opti.subject_to(opti.bounded(-acceleration[i], q2 * s**2 + q1 * s1, acceleration[i]))
            opti.subject_to(
                opti.bounded(-jerk[i], q3 * s**3 + 3 * q2 * s * s1 + q1 * bend, jerk[i])
            )
    u = np.linspace(0, 1, INTERVALS + 1)
    opti.set_initial(length, guess)
    opti.set_initial(rate, 1 - 3 * u**2 + 2 * u**3)
    opti.set_initial(shown, at + guess * (u - u**3 + u**4 / 2))
    opti.set_initial(change, (6 * u**2 - 6 * u) / guess)
    opti.minimize(length)
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})
    return float(opti.solve().value(length))


@pytest.mark.parametrize("seed", mostly_exhaustive(range(6), 0, 1, 2))
def test_stop_of_three_joints_is_shortest(seed: int) -> None:
    rng = np.random.default_rng(seed)
    degree = rng.integers(3, 6)
    c = 3 * rng.normal(size=(degree + 1, 3)) / 4.0 ** np.arange(degree, -1, -1)[:, None]
    curve = kw.PiecewisePolynomial(c[:, None], [0.0, 6.0])
    at = rng.uniform(0.2, 2.5)
    peaks = [np.abs(curve(np.linspace(at, 4, 200), nu)).max(axis=0) for nu in (2, 3)]
    acceleration = 0.1 + peaks[0] * rng.uniform(1, 3, 3)
    jerk = peaks[1] * rng.uniform(1, 4, 3) + acceleration * rng.uniform(1, 8)
    found = stop_on_path(curve, at, JointLimits([np.inf] * 3, acceleration, jerk))
    _, motion = found
    shortest = by_collocation(c, at, acceleration, jerk, float(motion.x[-1]))
    assert 0.995 * shortest <= motion.x[-1] <= 1.02 * shortest
    for nu in range(3):
        assert np.abs(motion(0.0, nu) - curve(at, nu)).max() < 1e-12
    for nu, limit in ((2, acceleration), (3, jerk)):
        assert (motion.extrema(nu).peak <= limit).all()


@pytest.mark.parametrize("at", [0.1, 0.5, 1.25])
def test_stop_of_one_joint_is_shortest(at: float) -> None:
    """Its path leaves it free: the shortest stop is that of the joint by itself, in closed form."""
    task = {
        "limits": {"acceleration": 4, "velocity": 2, "jerk": 40},
        "times": "fastest",
        "waypoints": [{"joints": {"a": 0}}, {"joints": {"a": 2}}],
    }
    plan = kw.plan(task)
    q, v, a = (plan.trajectory(at, nu) for nu in range(3))
    shortest = stop_joints(q, v, a, JointLimits([2.0], [4.0], [40.0])).x[-1]
    stop = plan.stop(at)
    assert stop.report.ok
    assert shortest * (1 - 1e-6) <= stop.trajectory.duration <= 1.04 * shortest


def turns() -> kw.Plan:
    """As fast as it may: there, where a gripper opens and a wait follows, and back."""
    return kw.plan(
        {
            "limits": {"acceleration": 4, "jerk": 40},
            "times": "fastest",
            "waypoints": [
                {"joints": {"a": 0, "b": 1}},
                {
                    "name": "there",
                    "joints": {"a": 1, "b": 0.2},
                    "do": [{"light": "on", "before": 0.1}, {"jaw": "open"}, {"wait": 0.3}],
                },
                {"joints": {"a": 0, "b": 1}, "do": {"jaw": "close"}},
            ],
        }
    )


@pytest.mark.parametrize("before", [0.6, 0.3, 0.05])
def test_stop_ends_at_rest_of_motion(before: float) -> None:
    plan = turns()
    rest = next(waypoint.time for waypoint in plan.scenario.waypoints if waypoint.name == "there")
    stop = plan.stop(rest - before)
    assert stop.report.ok
    assert stop.trajectory.duration <= before + 1e-9
    if before < 0.5:  # it brakes as hard as it may already
        assert stop.trajectory.duration == pytest.approx(before, abs=1e-9)
        assert stop.scenario.waypoints[-1].name == "there"
        passed = [event.text for event in stop.events]
        assert passed == ["light on", "jaw open"]
        messages = [one.message for one in stop.report.findings if one.group == "Events"]
        assert any(one.startswith(f"jaw open at {before:.3f} s: at 'there'") for one in messages)


@pytest.mark.parametrize("on_path", [True, False])
def test_refuses_stop_at_rest(on_path: bool) -> None:
    plan = turns()
    there = next(waypoint.time for waypoint in plan.scenario.waypoints if waypoint.name == "there")
    for at in (0.0, there, there + 0.1, plan.trajectory.end_time):
        with pytest.raises(InputError, match="is at rest"):
            plan.stop(at, on_path=on_path)
    with pytest.raises(InputError, match="at is 'x'"):
        plan.stop("x", on_path=on_path)  # type: ignore[arg-type]
