"""What is read from logs; their noise, and the motion behind them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from robot_logs import START, record, smooth, write_rows
from scipy.interpolate import make_lsq_spline

from cases import cases
from knotwork import Plan
from knotwork.errors import InputError
from knotwork.verification.recording import Recording, Smoothed, read_log, smoothed

NAMES = ("pan", "lift_joint")
UNITS = ("rad", "rad")
TIME = np.arange(40) / 50.0
Q = np.column_stack((np.sin(TIME), 0.5 * np.cos(TIME)))
V = np.column_stack((np.cos(TIME), -0.5 * np.sin(TIME)))
KINDS = cases(__file__)


def cells(values: np.ndarray, digits: int = 5) -> list[list[str]]:
    return [[f"{value:.{digits}f}" for value in row] for row in values]


def rows(kind: str) -> tuple[list[str], list[list[str]], str]:
    """Headings, rows and delimiter of one kind of log."""
    headings, row = KINDS[kind]
    delimiter = next(mark for mark in (";", "\t", ",", " ") if mark in headings)
    body = []
    degrees = cells(np.degrees(Q), 4)
    for t, q, v, d in zip(TIME.tolist(), cells(Q), cells(V), degrees, strict=True):
        sec, nanosec = divmod(round(t * 1e9) + round(START) * 1_000_000_000, 1_000_000_000)
        line = row.format(
            t=t, ms=1e3 * t, arrival=START + t + 0.003, sec=sec, nanosec=nanosec, pan=q[0],
            lift=q[1], pan_speed=v[0], lift_speed=v[1], pan_degrees=d[0], lift_degrees=d[1],
        )  # fmt: skip
        body.append((line.replace(".", ",") if delimiter == ";" else line).split(delimiter))
    if kind == "PlotJuggler":
        body.insert(7, [f"{START + 0.1:.6f}", *[""] * 7, "0.25"])  # a row of another topic
    return headings.split(delimiter), body, delimiter


@pytest.mark.parametrize("kind", KINDS)
def test_reads_every_kind_of_log(tmp_path: Path, kind: str) -> None:
    head, body, delimiter = rows(kind)
    log = read_log(write_rows(tmp_path / "log.csv", head, body, delimiter), NAMES, UNITS)
    assert log.time == pytest.approx(TIME, abs=3e-7)
    assert log.position == pytest.approx(Q, abs=6e-6)
    assert log.period == pytest.approx(0.02)
    last = np.radians(1e-4) if kind == "spreadsheet" else 1e-5
    assert log.resolution == pytest.approx([last, last])


def test_prefers_stamp_to_reception_time(tmp_path: Path) -> None:
    head, body, _ = rows("PlotJuggler")
    log = read_log(write_rows(tmp_path / "log.csv", head, body), NAMES, UNITS)
    assert log.origin == pytest.approx(START, abs=1e-6)
    assert log.notes == ("rows without the time or a joint's position: 1",)


def test_reads_stamp_of_own_topic(tmp_path: Path) -> None:
    head, body, _ = rows("PlotJuggler")
    head += ["/imu/header/stamp/sec", "/imu/header/stamp/nanosec"]
    body = [[*row, "7", "0"] for row in body]
    log = read_log(write_rows(tmp_path / "log.csv", head, body), NAMES, UNITS)
    assert log.origin == pytest.approx(START, abs=1e-6)


def plain(tmp_path: Path, positions: np.ndarray, times: np.ndarray = TIME) -> Path:
    body = [[f"{t:.6f}", *row] for t, row in zip(times, cells(positions), strict=True)]
    return write_rows(tmp_path / "log.csv", ["time", *NAMES], body)


def test_degrees_are_stated_or_noticed(tmp_path: Path) -> None:
    file = plain(tmp_path, np.degrees(Q))
    log = read_log(file, NAMES, UNITS, degrees=True)
    assert log.position == pytest.approx(Q, abs=1e-6)
    with pytest.raises(InputError) as error:
        read_log(file, NAMES, UNITS)
    assert "joint 'pan' reaches" in str(error.value)
    assert "the unit of the log" in str(error.value)
    assert "column 2 (pan)" in str(error.value)


def test_sorts_rows_and_averages_equal_times(tmp_path: Path) -> None:
    order = [1, 0, *range(2, 40)]
    times = TIME.copy()
    times[7] = times[8]
    log = read_log(plain(tmp_path, Q[order], times[order]), NAMES, UNITS)
    assert log.time.size == 39
    assert (np.diff(log.time) > 0).all()
    assert log.position[7] == pytest.approx(Q[7:9].mean(axis=0), abs=6e-6)
    assert log.notes == ("rows not in order of time: 1", "rows at the time of another row: 1")


HEADINGS = "t,q1,q2,qd1,qd2"
TWO_TOPICS = "time,/left/pan,/left/lift_joint,/right/pan,/right/lift_joint"


def refusal(path: Path, headings: str, body: list[list[str]], topic: str | None = None) -> str:
    """The error that a log gives."""
    with pytest.raises(InputError) as error:
        read_log(write_rows(path / "log.csv", headings.split(","), body), NAMES, UNITS, topic=topic)
    return str(error.value)


@pytest.mark.parametrize(
    ("headings", "topic", "message"),
    [
        ("counter,q1,q2,qd1,qd2", None, "line 1.*no column is the time.*header.stamp.sec"),
        ("time,timestamp,q1,q2,qd1", None, "2 columns are times.*one column named time"),
        (
            "t,elbow.position,pan.position,qd1,qd2",
            None,
            "'lift_joint'.*/joint_states/NAME/position",
        ),
        (TWO_TOPICS, None, "2 topics have positions.*: /left, /right.*the topic"),
        (TWO_TOPICS, "/x", "of the topic '/x'.*'pan', 'lift_joint'"),
        ("time,pan,pan [rad],lift_joint,x", None, "2 columns are the position of joint 'pan'"),
    ],
)
def test_names_what_headings_lack(
    tmp_path: Path, headings: str, topic: str | None, message: str
) -> None:
    _, body, _ = rows("counted from one")
    assert re.search(message, refusal(tmp_path, headings, body, topic))


def test_names_what_rows_lack(tmp_path: Path) -> None:
    _, body, _ = rows("counted from one")
    before, row, after = body[:4], body[4], body[5:]
    for changed, message in (
        (body[:9], "9 rows.*at least 16"),
        (
            [*before, [row[0], "1.2.3", *row[2:]], *after],
            r"line 6.*2 \(q1\).*'1.2.3' is not a number",
        ),
        ([*before, row[:3], *after], "line 6.*has 3 values.*5, as in the headings"),
        ([["1.0", *row[1:]] for row in body], "samples at 1 times.*at least 16"),
        ([], "has no rows"),
    ):
        assert re.search(message, refusal(tmp_path, HEADINGS, changed))
    assert "has no rows" in refusal(tmp_path, "", [])


BEFORE = 0.5


def gaps(curve: Smoothed, plan: Plan, order: int) -> np.ndarray:
    """Errors of the curve in standard errors, within the motion's time."""
    inside = (curve.grid > BEFORE + 0.01) & (curve.grid < BEFORE + plan.trajectory.duration - 0.01)
    time = curve.grid[inside]
    error = curve.trajectory(time, order) - plan.trajectory(time - BEFORE, order)
    return np.asarray(error / curve.errors[order][inside])


@pytest.mark.parametrize("noise", [1e-3, 1e-5])
def test_estimates_noise(tmp_path: Path, deburring: Plan, noise: float) -> None:
    curve = smooth(tmp_path, deburring.trajectory, record(deburring.trajectory, noise=noise))
    assert curve.noise.position == pytest.approx(np.full(6, noise), rel=0.2)
    assert not curve.noise.stated


def test_noise_of_short_logs_is_not_too_small() -> None:
    """Too small a noise would decide what a log can't decide."""
    random, time, names = np.random.default_rng(0), np.arange(64) / 50.0, tuple("abcdef")
    smooth_motion = np.sin(np.outer(time, np.linspace(0.2, 1.0, 6)))
    sizes = []
    for _ in range(40):
        position = smooth_motion + random.normal(0.0, 1e-4, smooth_motion.shape)
        log = Recording(names, ("rad",) * 6, time, position, np.full(6, 1e-9), 0.0, "log.csv", ())
        sizes.append(smoothed(log).sigma)
    assert 0.9e-4 < np.mean(sizes) < 1.25e-4


@pytest.mark.parametrize("jitter", [2e-4, 1e-3])
def test_estimates_jitter(tmp_path: Path, deburring: Plan, jitter: float) -> None:
    samples = record(deburring.trajectory, noise=1e-5, jitter=jitter, rate=100.0)
    curve = smooth(tmp_path, deburring.trajectory, samples)
    assert curve.noise.jitter == pytest.approx(jitter, rel=0.25)


def test_accepts_stated_noise(tmp_path: Path, deburring: Plan) -> None:
    samples = record(deburring.trajectory, noise=1e-4)
    curve = smooth(tmp_path, deburring.trajectory, samples, noise=5e-4)
    assert (curve.noise.position == 5e-4).all()
    assert curve.noise.stated
    finer = smooth(tmp_path, deburring.trajectory, samples)
    assert curve.trajectory.breaks.size < finer.trajectory.breaks.size
    for bad in (0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="noise"):
            smooth(tmp_path, deburring.trajectory, samples, noise=bad)


@pytest.mark.parametrize(
    ("rate", "noise", "jitter"), [(125.0, 1e-4, 0.0), (500.0, 1e-5, 0.0), (100.0, 1e-5, 5e-4)]
)
def test_curve_is_motion_within_standard_errors(
    tmp_path: Path, deburring: Plan, rate: float, noise: float, jitter: float
) -> None:
    samples = record(deburring.trajectory, rate=rate, noise=noise, jitter=jitter)
    curve = smooth(tmp_path, deburring.trajectory, samples)
    for order, most in ((0, 4.0), (1, 4.0), (2, 5.0)):
        off = gaps(curve, deburring, order)
        assert np.sqrt((off**2).mean()) < 1.2
        assert np.abs(off).max() < most
    share = curve.residuals / curve.sigma
    assert np.sqrt((share**2).mean()) == pytest.approx(1.0, abs=0.15)


def test_curve_equals_least_squares_spline_of_scipy(tmp_path: Path, deburring: Plan) -> None:
    curve = smooth(
        tmp_path, deburring.trajectory, record(deburring.trajectory, noise=1e-4), noise=1e-4
    )
    breaks = curve.trajectory.breaks
    knots = np.concatenate(([breaks[0]] * 3, breaks, [breaks[-1]] * 3))
    spline = make_lsq_spline(curve.log.time, curve.log.position, knots, k=3)
    for order in range(3):
        at = np.linspace(breaks[0], breaks[-1], 999)
        assert curve.trajectory(at, order) == pytest.approx(spline(at, order), abs=1e-8)
    assert curve.trajectory.continuity.order >= 2
