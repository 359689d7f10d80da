"""The check of a log: what is beyond its noise fails, what is within it does not."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from robot_logs import Samples, record, write

from knotwork import Plan, plan
from knotwork.recording import aligned, check_log, read_log, smoothed
from knotwork.scenario import Scenario
from knotwork.verification import Report


def judge(
    path: Path,
    made: Plan,
    samples: Samples,
    digits: int = 6,
    *,
    scenario: Scenario | None = None,
    velocity: bool = False,
    noise: float | None = None,
) -> Report:
    motion = made.trajectory
    file = write(path / "log.csv", samples, digits, velocity=velocity)
    curve = smoothed(read_log(file, motion.joint_names, motion.joint_units), noise)
    return check_log(aligned(curve, motion), scenario or made.scenario, made.space)


@pytest.mark.parametrize(
    ("rate", "noise", "digits", "jitter", "velocity"),
    [
        (500.0, 2e-5, 6, 0.0, True),
        (125.0, 1e-4, 5, 0.0, False),
        (100.0, 1e-5, 4, 3e-4, False),
        (50.0, 1e-3, 6, 0.0, True),
    ],
)
def test_a_good_motion_passes_however_noisy_its_log(
    tmp_path: Path,
    deburring: Plan,
    rate: float,
    noise: float,
    digits: int,
    jitter: float,
    velocity: bool,
) -> None:
    samples = record(deburring.trajectory, rate=rate, noise=noise, jitter=jitter)
    report = judge(tmp_path, deburring, samples, digits, velocity=velocity)
    assert report.ok, [str(one) for one in report.failures]
    said = " ".join(found.message for found in report.findings)
    assert "undecided" in said
    assert "estimated from the samples" in said
    assert report.select(quantity="time_shift")
    count = len(report.select(verdict="undecided"))
    assert str(report).splitlines()[0].endswith(f"requirements met, {count} undecided; 13 s")
    assert "undecided: off by less than 4 standard errors" in str(report)
    assert "not judged" not in str(report)


def test_a_fault_beyond_the_noise_fails(tmp_path: Path, deburring: Plan) -> None:
    samples = record(deburring.trajectory, noise=1e-5)
    q = samples.position
    q[:, 2] += 0.005 * np.exp(-(((samples.time - 0.5 - 8.0) / 0.5) ** 2))
    report = judge(tmp_path, deburring, samples)
    assert "path_deviation" in {found.quantity for found in report.failures}


def limited(made: Plan, share: float) -> Scenario:
    """The scenario with a limit of the tool's speed that its plan keeps or breaks."""
    (found,) = made.report.select(quantity="tool_speed")
    assert found.value is not None
    limits = dataclasses.replace(made.scenario.motion_limits, tool_speed=share * found.value)
    return dataclasses.replace(made.scenario, motion_limits=limits)


@pytest.mark.parametrize(("share", "noise", "verdict"), [
    (0.9, 1e-5, "failed"), (0.9999, 1e-4, "undecided"), (1.1, 1e-5, "met"),
])  # fmt: skip
def test_a_limit_is_broken_undecided_or_kept(
    tmp_path: Path, deburring: Plan, share: float, noise: float, verdict: str
) -> None:
    scenario = limited(deburring, share)
    samples = record(deburring.trajectory, noise=noise)
    report = judge(tmp_path, deburring, samples, scenario=scenario)
    (found,) = report.select(quantity="tool_speed")
    assert found.verdict == verdict
    assert ("undecided" in found.message) == (verdict == "undecided")


@pytest.mark.parametrize("noise", [1e-5, 1e-4])
def test_a_jump_fails_and_where_it_is_is_said(
    tmp_path: Path, deburring: Plan, noise: float
) -> None:
    samples = record(deburring.trajectory, noise=noise)
    samples.position[900:, 3] += 40.0 * noise
    report = judge(tmp_path, deburring, samples)
    (jump,) = [one for one in report.failures if one.quantity == "sample_off_the_curve"]
    assert jump.name == deburring.trajectory.joint_names[3]
    assert jump.time == pytest.approx(samples.time[900] - 0.5, abs=0.05)
    assert "jumps, or the sample is wrong" in jump.message


def test_a_wrong_sample_fails_and_noise_as_large_hides_it(tmp_path: Path, deburring: Plan) -> None:
    samples = record(deburring.trajectory, noise=1e-5)
    samples.position[700, 1] += 0.003
    report = judge(tmp_path, deburring, samples)
    (wrong,) = [one for one in report.failures if one.quantity == "sample_off_the_curve"]
    assert wrong.name == deburring.trajectory.joint_names[1]
    assert wrong.time == pytest.approx(samples.time[700] - 0.5, abs=1e-3)
    assert judge(tmp_path, deburring, samples, noise=1e-3).ok


def test_a_sudden_change_of_speed_fails(tmp_path: Path, deburring: Plan) -> None:
    samples = record(deburring.trajectory, noise=1e-5)
    after = np.maximum(samples.time - 5.5, 0.0)
    samples.position[:, 0] += 0.1 * np.minimum(after, 0.5)
    report = judge(tmp_path, deburring, samples)
    assert "sample_off_the_curve" in {one.quantity for one in report.failures}


def test_a_gap_is_warned_of_and_a_log_that_ends_early_fails(
    tmp_path: Path, deburring: Plan
) -> None:
    whole = record(deburring.trajectory, noise=1e-4)

    def part(keep: np.ndarray) -> Samples:
        return Samples(whole.names, whole.time[keep], whole.position[keep], whole.velocity[keep])

    gap = judge(tmp_path, deburring, part((whole.time < 4.0) | (whole.time > 4.2)))
    assert [one.quantity for one in gap.warnings if one.quantity == "gap"] == ["gap"]
    short = judge(tmp_path, deburring, part(whole.time < 10.0))
    assert "time_span" in {one.quantity for one in short.failures}


def test_bare_joints_have_logs_too(tmp_path: Path, paper_case: Plan) -> None:
    samples = record(paper_case.trajectory, rate=50.0, noise=1e-4)
    report = judge(tmp_path, paper_case, samples)
    assert report.ok, [str(one) for one in report.failures]
    assert not report.select(quantity="tool_deviation")


@pytest.mark.exhaustive
@pytest.mark.parametrize("scenario", ["ur10_spray", "ur10_weld", "xarm7_bead", "panda_pick_place"])
@pytest.mark.parametrize(
    ("rate", "noise", "jitter", "digits"),
    [(500.0, 1e-5, 0.0, 6), (125.0, 1e-4, 0.0, 6), (100.0, 1e-5, 3e-4, 4)],
)
def test_logs_of_other_scenarios_pass(
    tmp_path: Path, scenario: str, rate: float, noise: float, jitter: float, digits: int
) -> None:
    made = plan(scenario)
    samples = record(made.trajectory, rate=rate, noise=noise, jitter=jitter, seed=2)
    report = judge(tmp_path, made, samples, digits)
    assert report.ok, [str(one) for one in report.failures]
