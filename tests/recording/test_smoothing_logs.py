"""The motion behind a log: its noise, the curve, and what the curve is known to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from robot_logs import Samples, record, smooth, write
from scipy.interpolate import make_lsq_spline

from knotwork import Plan
from knotwork.errors import InputError
from knotwork.verification.recording import Smoothed

BEFORE = 0.5


def curve_of(
    path: Path,
    plan: Plan,
    samples: Samples,
    digits: int = 6,
    *,
    noise: float | None = None,
) -> Smoothed:
    file = write(path / "log.csv", samples, digits)
    return smooth(file, plan.trajectory, noise)


def gaps(curve: Smoothed, plan: Plan, order: int) -> np.ndarray:
    """Errors of the curve in standard errors, within the motion's time."""
    inside = (curve.grid > BEFORE + 0.01) & (curve.grid < BEFORE + plan.trajectory.duration - 0.01)
    time = curve.grid[inside]
    error = curve.trajectory(time, order) - plan.trajectory(time - BEFORE, order)
    return np.asarray(error / curve.errors[order][inside])


@pytest.mark.parametrize("noise", [1e-3, 1e-5])
def test_estimates_noise(tmp_path: Path, deburring: Plan, noise: float) -> None:
    curve = curve_of(tmp_path, deburring, record(deburring.trajectory, noise=noise))
    assert curve.noise.position == pytest.approx(np.full(6, noise), rel=0.2)
    assert not curve.noise.stated


@pytest.mark.parametrize("jitter", [2e-4, 1e-3])
def test_estimates_jitter(tmp_path: Path, deburring: Plan, jitter: float) -> None:
    samples = record(deburring.trajectory, noise=1e-5, jitter=jitter, rate=100.0)
    curve = curve_of(tmp_path, deburring, samples)
    assert curve.noise.jitter == pytest.approx(jitter, rel=0.25)


def test_accepts_stated_noise(tmp_path: Path, deburring: Plan) -> None:
    samples = record(deburring.trajectory, noise=1e-4)
    curve = curve_of(tmp_path, deburring, samples, noise=5e-4)
    assert (curve.noise.position == 5e-4).all()
    assert curve.noise.stated
    finer = curve_of(tmp_path, deburring, samples)
    assert curve.trajectory.breaks.size < finer.trajectory.breaks.size
    for bad in (0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="noise"):
            curve_of(tmp_path, deburring, samples, noise=bad)


@pytest.mark.parametrize(
    ("rate", "noise", "jitter"), [(125.0, 1e-4, 0.0), (500.0, 1e-5, 0.0), (100.0, 1e-5, 5e-4)]
)
def test_curve_is_motion_within_standard_errors(
    tmp_path: Path, deburring: Plan, rate: float, noise: float, jitter: float
) -> None:
    samples = record(deburring.trajectory, rate=rate, noise=noise, jitter=jitter)
    curve = curve_of(tmp_path, deburring, samples)
    for order, most in ((0, 4.0), (1, 4.0), (2, 5.0)):
        off = gaps(curve, deburring, order)
        assert np.sqrt((off**2).mean()) < 1.2
        assert np.abs(off).max() < most
    share = curve.residuals / curve.sigma
    assert np.sqrt((share**2).mean()) == pytest.approx(1.0, abs=0.15)


def test_curve_equals_least_squares_spline_of_scipy(tmp_path: Path, deburring: Plan) -> None:
    curve = curve_of(tmp_path, deburring, record(deburring.trajectory, noise=1e-4), noise=1e-4)
    breaks = curve.trajectory.breaks
    knots = np.concatenate(([breaks[0]] * 3, breaks, [breaks[-1]] * 3))
    spline = make_lsq_spline(curve.log.time, curve.log.position, knots, k=3)
    for order in range(3):
        at = np.linspace(breaks[0], breaks[-1], 999)
        assert curve.trajectory(at, order) == pytest.approx(spline(at, order), abs=1e-8)
    assert curve.trajectory.continuity.order >= 2
