"""Overrides of motions that are at their limits already."""

from __future__ import annotations

import re

import numpy as np
import pytest

import knotwork as kw

LIMITS = {"acceleration": 4.0, "jerk": 40.0, "velocity": 1.5}


@pytest.fixture(scope="module")
def fastest() -> kw.Plan:
    ends = [{"joints": {"a": a, "b": b}} for a, b in ((0, 0), (1, -2), (3, 0.3))]
    ends[1] |= {"velocity": "free"}
    return kw.plan({"limits": LIMITS, "times": "fastest", "waypoints": ends})


def told(plan: kw.Plan) -> list[str]:
    return [one.message for one in plan.report.findings if one.quantity == "override"]


def test_constant_override_keeps_limits(fastest: kw.Plan) -> None:
    same = fastest.scaled({0: 1})
    assert same.report.ok
    assert not told(same)
    for nu in range(4):
        was, now = (one.trajectory.polynomial.extrema(nu).peak for one in (fastest, same))
        np.testing.assert_allclose(now, was, rtol=1e-12)


@pytest.mark.parametrize(
    "profile",
    [
        {0: 1, 0.3: 0.5},
        {0: 1, 0.7: 0.3, 1.4: 1},
        {0: 0.5, 2: 1},
        {0: 1, 0.8: 1, 1.0: 0, 1.3: 0, 1.5: 1},
        {0: 0.9, 0.1: 0.2, 0.2: 0.9},
    ],
)
def test_overrides_keep_limits_and_are_reported(
    fastest: kw.Plan, profile: dict[float, float]
) -> None:
    plan = fastest.scaled(profile)
    assert plan.report.ok
    run = dict(profile)
    for message in told(plan):
        pairs = re.findall(r"([\d.]+): ([\d.]+)", message.rpartition("instead")[2])
        run = {float(time): float(rate) for time, rate in pairs}
        assert run != profile
    # the time shown by quadrature of the override that is told, which is rounded to 3 digits
    t = np.linspace(0, plan.trajectory.duration, 20001)
    times, rates = np.array(list(run)), np.array(list(run.values()))
    i = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
    u = np.clip((t - times[i]) / np.diff(times)[i], 0, 1)
    level = np.where(u < 0.5, 2 * u**2, 1 - 2 * (1 - u) ** 2)
    rate = rates[i] + (rates[i + 1] - rates[i]) * level
    shown = np.append(0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t)))
    shown = np.minimum(shown, fastest.trajectory.duration)
    gap = plan.trajectory.position(t) - fastest.trajectory.position(shown)
    assert np.abs(gap).max() < 5e-3
    assert shown[-1] == pytest.approx(fastest.trajectory.duration, abs=5e-3)
    # and it is near what was asked for
    assert min(abs(one - max(profile.values())) for one in run.values()) < 0.12
    assert min(run.values()) == min(profile.values())


def test_reports_infeasible_override_change(fastest: kw.Plan) -> None:
    assert told(fastest.scaled({0: 1, 0.8: 1, 0.85: 0.2, 0.9: 1}))
