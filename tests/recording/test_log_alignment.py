"""When the log of a motion is late, and by how much."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from robot_logs import START, Samples, record, smooth, write

import knotwork as kw
from command_line import Command
from events.welding import do, weld
from knotwork import Plan
from knotwork.errors import InputError
from knotwork.verification.recording import Alignment, aligned, deviation_findings
from plans import planned
from sweeps import first_of


def align(path: Path, plan: Plan, samples: Samples) -> Alignment:
    return aligned(smooth(path, plan.trajectory, samples), plan.trajectory)


@pytest.mark.parametrize("before", [0.0, 0.123456, 2.0041])
@pytest.mark.parametrize("noise", [1e-5, 1e-3])
def test_finds_shift_of_log(tmp_path: Path, deburring: Plan, before: float, noise: float) -> None:
    samples = record(deburring.trajectory, rate=100.0, noise=noise, before=before)
    found = align(tmp_path, deburring, samples)
    assert found.lead == pytest.approx(before, abs=5.0 * found.shift_error + 1e-7)
    assert found.shift_error < 0.02 / 100.0
    assert found.shift == pytest.approx(START + before, abs=1e-3)
    assert found.trajectory.start_time == deburring.trajectory.start_time
    assert found.trajectory.end_time == deburring.trajectory.end_time


def test_aligns_log_that_starts_in_middle(tmp_path: Path, deburring: Plan) -> None:
    whole = record(deburring.trajectory, noise=1e-4)
    late = Samples(whole.names, whole.time[400:] - whole.time[400], whole.position[400:])
    found = align(tmp_path, deburring, late)
    assert found.lead == pytest.approx(0.5 - whole.time[400], abs=1e-3)
    assert found.trajectory.start_time == pytest.approx(whole.time[400] - 0.5, abs=1e-3)


@pytest.mark.parametrize("joint", [0, 4])
def test_finds_worst_deviation_and_time(tmp_path: Path, deburring: Plan, joint: int) -> None:
    samples = record(deburring.trajectory, noise=1e-6)
    bump = 0.02 * np.exp(-(((samples.time - 0.5 - 6.2) / 0.2) ** 2))
    samples.position[:, joint] += bump
    found = align(tmp_path, deburring, samples)
    robot = deburring.joints.robot
    findings = list(deviation_findings(found, robot))
    joints = [finding for finding in findings if finding.quantity == "joint_deviation"]
    assert [one.name for one in joints] == list(deburring.trajectory.joint_names)
    worst = max(joints, key=lambda one: one.value or 0.0)
    assert worst.name == deburring.trajectory.joint_names[joint]
    assert worst.value == pytest.approx(0.02, rel=0.02)
    assert worst.time == pytest.approx(6.2, abs=0.02)
    (tool,) = [finding for finding in findings if finding.quantity == "tool_deviation"]
    q = deburring.trajectory.position(6.2)
    turned = q + 0.02 * np.eye(6)[joint]
    off = np.linalg.norm(robot.forward(turned).translation - robot.forward(q).translation)
    assert tool.value == pytest.approx(off, rel=0.05)
    assert tool.time == pytest.approx(6.2, abs=0.1)


def test_plan_at_rest_has_no_shift(tmp_path: Path, deburring: Plan) -> None:
    motion = deburring.trajectory
    q = motion.position(np.zeros(2))
    still = kw.JointTrajectory.from_knots(motion.joint_names, [0.0, 1.0], q, 0.0 * q)
    curve = smooth(tmp_path, motion, record(motion))
    with pytest.raises(InputError, match="never moves"):
        aligned(curve, still)
    other = dataclasses.replace(motion, joint_names=("a", "b", "c", "d", "e", "f"))
    with pytest.raises(InputError, match="joint"):
        aligned(curve, other)


Clock = Callable[[np.ndarray], np.ndarray]


def delayed(plan: kw.Plan, clock: Clock, noise: float = 1e-4) -> Samples:
    """A log that shows the plan at another time than its own; it begins 0.5 s before the plan."""
    motion = plan.trajectory
    whole = record(motion, rate=100.0, after=3.0)
    at = np.clip(clock(whole.time - 0.5), motion.start_time, motion.end_time)
    q = motion.position(at)
    q += np.random.default_rng(0).normal(0.0, noise, q.shape)
    return Samples(whole.names, whole.time, q)


def paused(at: float, lasts: float, again: float = np.inf) -> Clock:
    """The arm stands still for a while, and is on time again later."""
    return lambda t: np.where((t < at) | (t > again), t, np.maximum(at, t - lasts))


@pytest.mark.parametrize(
    ("scenario", "clock", "words"),
    [
        ("ur5_deburring", lambda t: t, ""),
        ("ur5_deburring", paused(7, 0.4), "0.4 s late from 7 s on"),
        ("ur5_deburring", paused(7, 0.4, 9), "up to 0.4 s late from 7 s to 8.6 s"),
        *first_of(
            ("ur5_deburring", lambda t: 0.95 * t, "up to 0.6 s late from 6.6 s on"),
            ("panda_three_parts", paused(3, -0.4), "up to 0.4 s early from 3.3 s on"),
        ),
    ],
)
def test_reports_begin_of_delay(tmp_path: Path, scenario: str, clock: Clock, words: str) -> None:
    plan = planned(scenario)
    found = align(tmp_path, plan, delayed(plan, clock))
    assert found.lead == pytest.approx(0.5, abs=0.06 if "0.6" in words else 2e-3)
    (late,) = (
        re.sub(r"[\d.]+", lambda one: f"{round(float(one[0]), 1):g}", finding.message)
        for finding in kw.recording.deviation_findings(found)
        if finding.quantity == "lateness"
    )
    assert late == (words or "the log is on time")


@pytest.mark.parametrize(
    ("clock", "tolerances", "code", "words"),
    [
        (paused(20, 0), ["0.5mm", "0.1deg", "joints=0.1deg"], 0, "Tolerances (8)"),
        (paused(20, 0), ["0.005mm"], 1, "tolerance 0.005 mm"),
        (paused(7, 0.4), ["0.5mm"], 1, "late from 7"),
        (paused(7, 0.4), ["0.5mm", "0.5s"], 0, "late from 7"),
        (paused(7, 0.4), ["0.3s"], 1, "tolerance 0.3 s"),
        (paused(7, 0.4), ["elbow_joint=0.1deg"], 1, "joint 'elbow_joint': off the plan by up to"),
        (paused(20, 0), ["elbow=0.1deg"], 2, "did you mean 'elbow_joint'"),
        *((paused(20, 0), [one], 2, "0.5mm, 0.1deg") for one in ("-1mm", "1", "1in", "nanmm")),
    ],
)
def test_log_is_judged_by_given_tolerances(
    knotwork: Command,
    tmp_path: Path,
    deburring: kw.Plan,
    clock: Clock,
    tolerances: list[str],
    code: int,
    words: str,
) -> None:
    deburring.save(tmp_path / "plan")
    log = write(tmp_path / "log.csv", delayed(deburring, clock, 1e-5))
    given = [part for one in tolerances for part in ("--tolerance", one)]
    ran = knotwork("check", log, "--against", tmp_path / "plan", *given)
    assert ran.code == code, ran.out
    assert words in " ".join((ran.out + ran.err).split())
    if code < 2:
        rows = [line for line in ran.out.splitlines() if re.match(r"  [A-Z]", line)]
        assert rows[0].startswith("  Against the plan")


def test_given_tolerances_replace_places_of_events(knotwork: Command, tmp_path: Path) -> None:
    task = weld(seam=do({"arc": "on"}), end=do({"arc": "off", "at": -20}))
    kw.Task(**task).save(tmp_path / "weld.yaml")
    plan = kw.plan(tmp_path / "weld.yaml")
    plan.save(tmp_path / "plan")
    paused_on_the_seam = paused(plan.scenario.events[1].event.time - 0.2, 0.4)
    log = write(tmp_path / "log.csv", delayed(plan, paused_on_the_seam, 1e-5))
    check = ("check", log, "--against", tmp_path / "plan", "--scenario", tmp_path / "weld.yaml")
    late = knotwork(*check, "--full")
    assert (late.code, "mm from that position" in " ".join(late.out.split())) == (1, True)
    within = knotwork(*check, "--tolerance", "0.5s")
    assert (within.code, "not say what is switched" in within.out) == (0, False)


def test_tool_tolerance_needs_robot(knotwork: Command, tmp_path: Path, deburring: kw.Plan) -> None:
    deburring.save(tmp_path / "plan")
    (tmp_path / "plan" / "report.json").unlink()
    log = write(tmp_path / "log.csv", delayed(deburring, paused(20, 0)))
    line = ("check", log, "--against", tmp_path / "plan", "--tolerance")
    assert "needs the scenario's robot" in knotwork(*line, "1mm").err
    assert knotwork(*line, "joints=0.1deg").code == 0
    assert knotwork("check", log, "-s", "ur5_deburring", "--tolerance", "1mm").code == 2
