"""A log beside its plan: the shift of the clock, and how far it is off."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from robot_logs import START, Samples, record, smooth, write

import knotwork as kw
from knotwork import Plan
from knotwork.errors import InputError
from knotwork.verification.recording import Alignment, aligned, deviation_findings
from plans import arm


def align(path: Path, plan: Plan, samples: Samples) -> Alignment:
    return aligned(smooth(write(path / "log.csv", samples), plan.trajectory), plan.trajectory)


@pytest.mark.parametrize("before", [0.0, 0.123456, 2.0041])
@pytest.mark.parametrize("noise", [1e-5, 1e-3])
def test_finds_shift_of_log(tmp_path: Path, deburring: Plan, before: float, noise: float) -> None:
    samples = record(deburring.trajectory, rate=100.0, noise=noise, before=before)
    found = align(tmp_path, deburring, samples)
    assert found.start == pytest.approx(before, abs=5.0 * found.shift_error + 1e-7)
    assert found.shift_error < 0.02 / 100.0
    assert found.shift == pytest.approx(START + before, abs=1e-3)
    assert found.trajectory.start_time == deburring.trajectory.start_time
    assert found.trajectory.end_time == deburring.trajectory.end_time


def test_aligns_log_that_starts_in_middle(tmp_path: Path, deburring: Plan) -> None:
    whole = record(deburring.trajectory, noise=1e-4)
    late = Samples(whole.names, whole.time[400:] - whole.time[400], whole.position[400:])
    found = align(tmp_path, deburring, late)
    assert found.start == pytest.approx(0.5 - whole.time[400], abs=1e-3)
    assert found.trajectory.start_time == pytest.approx(whole.time[400] - 0.5, abs=1e-3)


@pytest.mark.parametrize("joint", [0, 4])
def test_finds_worst_deviation_and_time(tmp_path: Path, deburring: Plan, joint: int) -> None:
    samples = record(deburring.trajectory, noise=1e-6)
    bump = 0.02 * np.exp(-(((samples.time - 0.5 - 6.2) / 0.2) ** 2))
    samples.position[:, joint] += bump
    found = align(tmp_path, deburring, samples)
    robot = arm(deburring)
    findings = list(deviation_findings(found, robot))
    joints = [one for one in findings if one.quantity == "joint_deviation"]
    assert [one.name for one in joints] == list(deburring.trajectory.joint_names)
    worst = max(joints, key=lambda one: one.value or 0.0)
    assert worst.name == deburring.trajectory.joint_names[joint]
    assert worst.value == pytest.approx(0.02, rel=0.02)
    assert worst.time == pytest.approx(6.2, abs=0.02)
    (tool,) = [one for one in findings if one.quantity == "tool_deviation"]
    q = deburring.trajectory.position(6.2)
    turned = q + 0.02 * np.eye(6)[joint]
    off = np.linalg.norm(robot.forward(turned).translation - robot.forward(q).translation)
    assert tool.value == pytest.approx(off, rel=0.05)
    assert tool.time == pytest.approx(6.2, abs=0.1)


def test_plan_at_rest_has_no_shift(tmp_path: Path, deburring: Plan) -> None:
    motion = deburring.trajectory
    q = motion.position(np.zeros(2))
    still = kw.JointTrajectory.from_knots(motion.joint_names, [0.0, 1.0], q, 0.0 * q)
    curve = smooth(write(tmp_path / "log.csv", record(motion)), motion)
    with pytest.raises(InputError, match="never moves"):
        aligned(curve, still)
    other = dataclasses.replace(motion, joint_names=("a", "b", "c", "d", "e", "f"))
    with pytest.raises(InputError, match="joint"):
        aligned(curve, other)
