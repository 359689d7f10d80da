"""Position-velocity-time tables: a drive that joins them by cubics makes our motion."""

from __future__ import annotations

import csv
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from motions import hermite_data, motion
from replay import hermite

from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from sweeps import examples


def read(text: str) -> tuple[list[str], list[str], np.ndarray]:
    lines = text.splitlines()
    comments = [line for line in lines if line.startswith("#")]
    head, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    return comments, head, np.array(rows, dtype=float)


@given(hermite_data())
@examples()
def test_a_drive_makes_the_motion(trajectory: JointTrajectory) -> None:
    _, head, rows = read(trajectory.to_pvt())
    assert head[0] == "time_from_start_s"
    assert rows[0, 0] == 0.0
    at = np.linspace(0.0, rows[-1, 0], 500)
    q, v = hermite(rows[:, 0], rows[:, 1::2], rows[:, 2::2], at)
    own = np.clip(at + trajectory.start_time, trajectory.start_time, trajectory.end_time)
    assert q == pytest.approx(trajectory(own), abs=1e-11)
    assert v == pytest.approx(trajectory(own, 1), abs=1e-9)


def test_degrees_are_for_what_turns() -> None:
    _, head, rows = read(motion().to_pvt(degrees=True))
    assert head[1:] == [
        "a.position_deg",
        "a.velocity_deg_per_s",
        "b.position_deg",
        "b.velocity_deg_per_s",
        "slide.position_m",
        "slide.velocity_m_per_s",
    ]
    knots = motion().knots
    assert np.radians(rows[:, 1:5:2]) == pytest.approx(knots.position[:, :2], abs=1e-15)
    assert np.radians(rows[:, 2:5:2]) == pytest.approx(knots.velocity[:, :2], abs=1e-14)
    assert (rows[:, 5] == knots.position[:, 2]).all()


def test_scale_and_offset_are_each_joints_own() -> None:
    comments, head, rows = read(
        motion().to_pvt(scale={"a": -4096 / math.tau}, offset={"a": 100.0, "slide": -1.0})
    )
    knots = motion().knots
    assert rows[:, 1] == pytest.approx(100 - 4096 / math.tau * knots.position[:, 0], rel=1e-14)
    assert rows[:, 2] == pytest.approx(-4096 / math.tau * knots.velocity[:, 0], rel=1e-14)
    assert (rows[:, 3] == knots.position[:, 1]).all()
    assert rows[:, 5] == pytest.approx(knots.position[:, 2] - 1, rel=1e-15)
    assert (rows[:, 6] == knots.velocity[:, 2]).all()
    assert head[1] == "a.position_drive"
    about = next(line for line in comments if "'a'" in line)
    assert "Columns 2, 3" in about
    assert "-651.8986" in about
    assert "+100" in about


def test_steps_add_up() -> None:
    time = np.cumsum(np.full(2001, 0.1)) - 0.1
    flat = np.zeros((2001, 1))
    curve = JointTrajectory.from_knots(["a"], time, flat, flat)
    _, head, rows = read(curve.to_pvt(incremental=True))
    assert head[0] == "time_step_s"
    assert rows[0, 0] == 0.0
    total = Fraction(0)
    for step, end in zip(rows[:, 0], time, strict=True):
        total += Fraction(step)
        assert abs(total - Fraction(end)) < 1e-13


@pytest.mark.parametrize("value", [0.0, True, 10**400, 1j, "2", None])
def test_scales_that_are_no_numbers(value: object) -> None:
    with pytest.raises(InputError, match="scale of joint 'a'"):
        motion().to_pvt(scale={"a": value})  # type: ignore[dict-item]


@pytest.mark.parametrize("what", ["scale", "offset"])
@pytest.mark.parametrize("value", [2.0, [2.0], "a"])
def test_factors_that_name_no_joint(what: str, value: object) -> None:
    with pytest.raises(InputError, match=f"{what} is .*mapping of joint names"):
        motion().to_pvt(**{what: value})  # type: ignore[arg-type]


def test_factors_beyond_all_numbers_are_refused() -> None:
    with pytest.raises(InputError, match=r"scale of joint 'a' is .*, which exceeds all"):
        motion().to_pvt(scale={"a": 1e308}, degrees=True)
