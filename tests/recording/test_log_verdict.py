"""The check of a log: what is beyond its noise fails, what is within it does not."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from robot_logs import Samples, record, smooth

from knotwork import Plan, plan
from knotwork.task.scenario import Scenario
from knotwork.verification import Report
from knotwork.verification.recording import LogTolerances, aligned, check_log, compare_log
from plans import planned
from sweeps import mostly_exhaustive


def judge(
    path: Path,
    source: Plan,
    samples: Samples,
    digits: int | None = 6,
    *,
    scenario: Scenario | None = None,
    noise: float | None = None,
) -> Report:
    alignment = aligned(smooth(path, source.trajectory, samples, digits, noise), source.trajectory)
    return check_log(alignment, scenario or source.scenario, source.joints)


@pytest.mark.parametrize(
    ("rate", "noise", "digits", "jitter"),
    [(500.0, 2e-5, 6, 0.0), (100.0, 1e-5, 4, 3e-4), (50.0, 1e-3, 6, 0.0)],
)
def test_good_motion_passes_with_noisy_log(
    tmp_path: Path, deburring: Plan, rate: float, noise: float, digits: int, jitter: float
) -> None:
    samples = record(deburring.trajectory, rate=rate, noise=noise, jitter=jitter)
    report = judge(tmp_path, deburring, samples, digits)
    assert report.ok, [str(finding) for finding in report.failures]
    messages = " ".join(found.message for found in report.findings)
    assert "undecided" in messages
    assert "estimated from the samples" in messages
    assert report.select(quantity="time_shift")
    count = len(report.select(verdict="undecided"))
    met, required = len(report.select(verdict="met")), report.counts[1]
    assert required == met + count + len(report.failures)
    assert f" {met} of {required} requirements met" in str(report)
    assert str(report).splitlines()[0].endswith(f"requirements met, {count} undecided; 13 s")
    assert "undecided: within 4 standard errors of the limit" in str(report)
    assert "not judged" not in str(report)
    at_waypoints = len(report.select(group="Tool at the waypoints"))
    assert f"Tool at the waypoints ({at_waypoints})" in str(report)


def test_fault_beyond_noise_fails(tmp_path: Path, deburring: Plan) -> None:
    samples = record(deburring.trajectory, noise=1e-5)
    q = samples.position
    q[:, 2] += 0.005 * np.exp(-(((samples.time - 0.5 - 8.0) / 0.5) ** 2))
    report = judge(tmp_path, deburring, samples)
    assert "path_deviation" in {finding.quantity for finding in report.failures}


@pytest.mark.parametrize(("share", "noise", "verdict"), [
    (0.9, 1e-5, "failed"), (0.9999, 1e-4, "undecided"), (1.1, 1e-5, "met"),
])  # fmt: skip
def test_limit_is_broken_undecided_or_kept(
    tmp_path: Path, deburring: Plan, share: float, noise: float, verdict: str
) -> None:
    (reached,) = deburring.report.select(quantity="tool_speed")
    given = deburring.scenario.motion_limits
    limits = given.model_copy(update={"tool_speed": share * reached.value})
    scenario = dataclasses.replace(deburring.scenario, motion_limits=limits)
    samples = record(deburring.trajectory, noise=noise)
    report = judge(tmp_path, deburring, samples, scenario=scenario)
    (finding,) = report.select(quantity="tool_speed")
    assert finding.verdict == verdict
    assert ("undecided" in finding.message) == (verdict == "undecided")


def test_wrong_sample_fails_unless_within_noise(tmp_path: Path, deburring: Plan) -> None:
    samples = record(deburring.trajectory, noise=1e-5)
    samples.position[700, 1] += 0.003
    report = judge(tmp_path, deburring, samples)
    (wrong,) = [one for one in report.failures if one.quantity == "sample_off_the_curve"]
    assert wrong.name == deburring.trajectory.joint_names[1]
    assert wrong.time == pytest.approx(samples.time[700] - 0.5, abs=1e-3)
    assert judge(tmp_path, deburring, samples, noise=1e-3).ok


def part(whole: Samples, keep: np.ndarray) -> Samples:
    return Samples(whole.names, whole.time[keep], whole.position[keep])


def holes(report: Report) -> list[tuple[str, str]]:
    return [(finding.verdict, str(finding)) for finding in report.select(quantity="gap")]


def test_gap_while_plan_moves_fails(tmp_path: Path, deburring: Plan) -> None:
    whole = record(deburring.trajectory, noise=1e-4)  # every 8 ms, the plan starts at 0.5 s
    report = judge(tmp_path, deburring, part(whole, (whole.time < 4.5) | (whole.time > 8.0)))
    (hole,) = holes(report)
    assert hole[0] == "failed"
    assert hole[1].startswith(
        "the log has no sample from 3.996 s to 7.508 s: 3.512 s, 439 times its interval of 8 ms; "
        "the plan moves there, so the motion of the robot is undecided"
    )
    short = judge(tmp_path, deburring, part(whole, (whole.time < 4.5) | (whole.time > 4.53)))
    assert not holes(short)
    assert short.ok
    # the mean of what is recorded at one time is one sample, and rows without numbers are none
    within = (whole.time > 4.5) & (whole.time < 8.0)
    stuck, lost = np.where(within, 4.5, whole.time), whole.position.copy()
    lost[within, 3] = np.nan
    for time, position in ((stuck, whole.position), (whole.time, lost)):
        report = judge(tmp_path, deburring, Samples(whole.names, time, position))
        assert [verdict for verdict, _ in holes(report)] == ["failed"]


def test_reports_gaps_within_plan_only(tmp_path: Path, deburring: Plan) -> None:
    whole = record(deburring.trajectory, noise=1e-4, before=3.0, after=3.0)
    at = whole.time - 3.0
    lost = ((at > -2.5) & (at < -1.0)) | ((at > 14.0) & (at < 15.5))
    report = judge(tmp_path, deburring, part(whole, ~lost))
    assert report.ok, [str(finding) for finding in report.failures]
    assert not holes(report)
    lost |= ((at > 2.0) & (at < 2.5)) | ((at > 6.0) & (at < 7.0))
    found = holes(judge(tmp_path, deburring, part(whole, ~lost)))
    assert [verdict for verdict, _ in found] == ["failed", "failed"]


def waiting() -> Plan:
    here, there = {"joints": {"turn": 0}}, {"joints": {"turn": 1}, "after": 2}
    return plan({"name": "wait", "waypoints": [here, {**there, "wait": 3}, {**here, "after": 2}]})


def test_unresolved_requirements_are_undecided(tmp_path: Path, deburring: Plan) -> None:
    """With a noise of 0.2 rad nobody knows of a clearance of 14 mm, nor of a speed."""
    report = judge(tmp_path, deburring, record(deburring.trajectory, noise=0.2))
    assert report.ok
    near = [finding for finding in report.select(quantity="clearance") if finding.value < 0.02]
    assert near
    assert {one.verdict for one in near} == {"undecided"}
    (speed,) = report.select(quantity="tool_speed")
    assert speed.verdict == "undecided"
    exact = judge(tmp_path, deburring, record(deburring.trajectory, noise=1e-5))
    near = [finding for finding in exact.select(quantity="clearance") if finding.value < 0.02]
    assert {one.verdict for one in near} == {"met"}


@pytest.mark.parametrize(("off", "verdict"), [(0.0, "undecided"), (0.01, "failed")])
def test_wait_is_judged_within_noise(tmp_path: Path, off: float, verdict: str) -> None:
    source = waiting()
    samples = record(source.trajectory, noise=1e-4)
    samples.position[:, 0] += off * np.exp(-(((samples.time - 4.0) / 0.3) ** 2))
    (finding,) = judge(tmp_path, source, samples).select(subject="wait")
    assert finding.verdict == verdict


def test_gap_while_plan_rests_is_a_warning(tmp_path: Path) -> None:
    source = waiting()
    whole = record(source.trajectory, noise=1e-4)
    report = judge(tmp_path, source, part(whole, (whole.time < 3.0) | (whole.time > 5.0)))
    assert report.ok, [str(finding) for finding in report.failures]
    ((verdict, message),) = holes(report)
    assert verdict == "warning"
    assert "the plan is at rest there, which the log does not confirm" in message


@pytest.mark.parametrize(("first", "last"), [(0.0, 10.0), (4.0, 20.0)])
def test_incomplete_log_fails(tmp_path: Path, deburring: Plan, first: float, last: float) -> None:
    whole = record(deburring.trajectory, noise=1e-4)
    cut = part(whole, (whole.time >= first) & (whole.time < last))
    report = judge(tmp_path, deburring, cut)
    assert "time_span" in {finding.quantity for finding in report.failures}
    motion = deburring.trajectory
    # no scenario says how long it has to be
    compared = compare_log(aligned(smooth(tmp_path, motion, cut), motion))
    ((verdict, message),) = holes(compared)
    assert verdict == "failed"
    assert "has no sample from" in message


@pytest.mark.parametrize(("joints", "end"), [([2], 5.0), ([0, 1, 2, 3, 4, 5], 20.0)])
def test_stuck_channel(tmp_path: Path, deburring: Plan, joints: list[int], end: float) -> None:
    """What the recorder repeats looks as if the robot stood, and then jumped."""
    samples = record(deburring.trajectory, noise=1e-4)
    held = (samples.time > 4.5) & (samples.time < end)
    samples.position[np.ix_(held, joints)] = samples.position[np.flatnonzero(held)[0], joints]
    assert not judge(tmp_path, deburring, samples).ok


def ends_suddenly(end: float) -> dict[str, Any]:
    """Its acceleration goes to zero in the last 3.7 ms, after the last sample."""
    return {
        "end_acceleration": "zero",
        "knots": [0, 0.3, 1.0, 1.0037],
        "waypoints": [
            {"name": "a", "time": 0, "joints": {"j": 0}, "stop": True},
            {"name": "b", "time": 1.0037, "joints": {"j": end}, "stop": True},
        ],
    }


@pytest.mark.parametrize("rate", [125.0, 500.0])
def test_motion_after_last_sample_is_not_a_failure(tmp_path: Path, rate: float) -> None:
    source = plan(ends_suddenly(1.0))
    samples = record(source.trajectory, rate=rate, before=0.0, after=0.0)
    assert 0.0 < source.trajectory.end_time - samples.time[-1] < 0.004
    report = judge(tmp_path, source, samples, None)
    assert report.ok, [str(finding) for finding in report.failures]
    # a motion that ends elsewhere is still found
    short = record(plan(ends_suddenly(0.999)).trajectory, rate=rate, before=0.0, after=0.0)
    report = judge(tmp_path, source, short, None)
    assert "b" in {finding.name for finding in report.failures}


@pytest.mark.parametrize(("scenario", "rate"), [("paper_case", 333.0), ("ur5_palletise", 250.0)])
def test_rounding(tmp_path: Path, scenario: str, rate: float) -> None:
    """Also where the acceleration jumps as the motion begins and ends."""
    source = planned(scenario)
    report = judge(tmp_path, source, record(source.trajectory, rate=rate))
    assert report.ok, [str(finding) for finding in report.failures]


@pytest.mark.parametrize(
    ("noise", "kind", "size"),
    mostly_exhaustive(
        [
            (0.0, "position", 1e-5),
            (0.0, "velocity", 1e-3),
            (1e-5, "position", 4e-4),
            (1e-5, "velocity", 0.1),
        ],
        *[(0.0, "position", 1e-5), (1e-5, "velocity", 0.1)],
    ),
)
def test_finds_jumps_above_noise(
    tmp_path: Path, deburring: Plan, noise: float, kind: str, size: float
) -> None:
    """Joint 2 jumps in position, or in velocity for 0.3 s."""
    samples = record(deburring.trajectory, noise=noise)
    after = samples.time - 4.53
    steps = {"position": (after >= 0.0).astype(float), "velocity": np.clip(after, 0.0, 0.3)}
    samples.position[:, 2] += size * steps[kind]
    report = judge(tmp_path, deburring, samples, 6 if noise else None)
    found = {one.name for one in report.failures if one.quantity == "sample_off_the_curve"}
    assert deburring.trajectory.joint_names[2] in found


@pytest.mark.parametrize(("off", "passes"), [(0.01, True), (0.1, False)])
def test_wrong_sample_fails_beyond_tolerance(
    tmp_path: Path, deburring: Plan, off: float, passes: bool
) -> None:
    """One sample of joint 2 is wrong; the smoothed curve may hardly follow it."""
    samples = record(deburring.trajectory, noise=1e-5)
    samples.position[len(samples.time) // 2, 2] += off
    alignment = aligned(smooth(tmp_path, deburring.trajectory, samples), deburring.trajectory)
    tolerances = LogTolerances(joints={"rad": 0.05})
    (found,) = (
        finding
        for finding in compare_log(alignment, tolerances=tolerances).findings
        if finding.quantity == "sample_off_the_curve" and finding.name == "elbow_joint"
    )
    assert found.ok == passes
    assert found.limit == 0.05
