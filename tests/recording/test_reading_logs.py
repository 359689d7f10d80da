"""What is read from logs; their noise, and the motion behind them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from robot_logs import START, Samples, record, smooth, write, write_rows
from scipy.interpolate import make_lsq_spline

from knotwork import Plan
from knotwork.errors import InputError
from knotwork.verification.recording import Recording, Smoothed, read_log, smoothed

NAMES = ("pan", "lift_joint")
UNITS = ("rad", "rad")
TIME = np.arange(40) / 50.0
Q = np.column_stack((np.sin(TIME), 0.5 * np.cos(TIME)))
V = np.column_stack((np.cos(TIME), -0.5 * np.sin(TIME)))


def cells(values: np.ndarray, digits: int = 5) -> list[list[str]]:
    return [[f"{value:.{digits}f}" for value in row] for row in values]


def ros_stamp(t: float) -> list[str]:
    nanoseconds = round(t * 1e9) + round(START) * 1_000_000_000
    return [str(nanoseconds // 1_000_000_000), str(nanoseconds % 1_000_000_000)]


def rows(kind: str) -> tuple[list[str], list[list[str]], str]:
    """Headings, rows and delimiter of one kind of log."""
    q, v, n = cells(Q), cells(V), range(len(TIME))
    stamps = [f"{START + t:.9f}" for t in TIME]
    whole = [f"{round((START + t) * 1e9)}" for t in TIME]
    degrees = cells(np.degrees(Q), 4)
    match kind:
        case "PlotJuggler":
            head = [
                "__time", "/joint_states/header/stamp/nanosec", "/joint_states/header/stamp/sec",
                "/joint_states/lift_joint/position", "/joint_states/lift_joint/velocity",
                "/joint_states/pan/effort", "/joint_states/pan/position",
                "/joint_states/pan/velocity", "/tf/base/translation/x",
            ]  # fmt: skip
            body = [
                [f"{START + TIME[i] + 0.003:.6f}", *ros_stamp(TIME[i])[::-1],
                 q[i][1], v[i][1], "1.5", q[i][0], v[i][0], ""] for i in n
            ]  # fmt: skip
            other = [f"{START + 0.1:.6f}", *[""] * 7, "0.25"]
            return head, [*body[:7], other, *body[7:]], ","
        case "flattened message":
            head = ["header.stamp.sec", "header.stamp.nanosec", "header.frame_id"]
            head += ["name[0]", "name[1]", "position[0]", "position[1]", "velocity[0]"]
            head += ["velocity[1]", "effort[0]", "effort[1]"]
            body = [
                [*ros_stamp(TIME[i]), "base", "lift_joint", "pan", *q[i][::-1], *v[i][::-1], "", ""]
                for i in n
            ]
            return head, body, ","
        case "rostopic echo":
            head = ["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id"]
            head += ["field.name0", "field.name1", "field.position0", "field.position1"]
            head += ["field.velocity0", "field.velocity1"]
            body = [
                [str(int(whole[i]) + 999), str(i), whole[i], "", "pan", "lift_joint", *q[i], *v[i]]
                for i in n
            ]
            return head, body, ","
        case "RTDE":
            head = ["timestamp", "target_q_0", "target_q_1", "actual_q_0", "actual_q_1"]
            head += ["actual_qd_0", "actual_qd_1", "robot_mode"]
            body = [[f"{TIME[i]:.4f}", "9", "9", *q[i], *v[i], "7"] for i in n]
            return head, body, " "
        case "spreadsheet":
            head = ["Time [ms]", "pan [deg]", "lift_joint [deg]", "pan [deg/s]"]
            head += ["lift_joint [deg/s]"]
            speeds = cells(np.degrees(V), 4)
            body = [
                [
                    cell.replace(".", ",")
                    for cell in (f"{1e3 * TIME[i]:.1f}", *degrees[i], *speeds[i])
                ]
                for i in n
            ]
            return head, body, ";"
        case "controller state":  # of ROS 2's joint_trajectory_controller
            head = ["header.stamp.sec", "header.stamp.nanosec", "joint_names[0]", "joint_names[1]"]
            for group in ("reference", "feedback", "error", "output"):
                head += [
                    f"{group}.{what}[{k}]" for what in ("positions", "velocities") for k in (0, 1)
                ]
            nothing = ["9"] * 4
            body = [
                [*ros_stamp(TIME[i]), "lift_joint", "pan", *nothing, *q[i][::-1], *v[i][::-1],
                 *nothing, *nothing] for i in n
            ]  # fmt: skip
            return head, body, ","
        case "counted from one":
            return (
                ["t", "q1", "q2", "qd1", "qd2"],
                [[f"{TIME[i]:.3f}", *q[i], *v[i]] for i in n],
                ",",
            )
        case _:
            head = ["timestamp", "position/pan", "position/lift_joint", "velocity/pan"]
            head += ["velocity/lift_joint"]
            return head, [[stamps[i], *q[i], *v[i]] for i in n], "\t"


@pytest.mark.parametrize(
    "kind",
    [
        "PlotJuggler",
        "flattened message",
        "rostopic echo",
        "controller state",
        "RTDE",
        "spreadsheet",
        "counted from one",
        "quantity first",
    ],
)
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
    assert log.notes == ("1 rows without time and position of every joint",)


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
    assert "--log-unit deg" in str(error.value)
    assert "column 2 (pan)" in str(error.value)


def test_sorts_rows_and_averages_equal_times(tmp_path: Path) -> None:
    order = [1, 0, *range(2, 40)]
    times = TIME.copy()
    times[7] = times[8]
    log = read_log(plain(tmp_path, Q[order], times[order]), NAMES, UNITS)
    assert log.time.size == 39
    assert (np.diff(log.time) > 0).all()
    assert log.position[7] == pytest.approx(Q[7:9].mean(axis=0), abs=6e-6)
    assert log.notes == ("1 rows were out of the order of time and 1 rows had the time of another",)


def two_topics() -> tuple[list[str], list[list[str]]]:
    head = ["time"]
    for topic in ("/left/state", "/right/state"):
        head += [f"{topic}/{name}/position" for name in NAMES]
    return head, [[f"{t:.3f}", *q, "0.1", "0.2"] for t, q in zip(TIME, cells(Q), strict=True)]


def read_changed(tmp_path: Path, change: str) -> Recording:
    head, body, _ = rows("counted from one")
    match change:
        case "few":
            body = body[:9]
        case "no number":
            body[4][1] = "1.2.3"
        case "short row":
            body[4] = body[4][:3]
        case "no time":
            head[0] = "counter"
        case "two times":
            head = ["time", "timestamp", "q1", "q2", "qd1"]
        case "joint missing":
            head[1] = "elbow.position"
            head[2] = "pan.position"
        case "topics":
            head, body = two_topics()
        case "topic unknown":
            head, body = two_topics()
            return read_log(write_rows(tmp_path / "l.csv", head, body), NAMES, UNITS, topic="/x")
        case "twice":
            head = ["time", "pan", "pan [rad]", "lift_joint", "x"]
        case "headings only":
            body = []
        case "empty":
            head, body = [], []
        case "one time":
            body = [["1.0", *row[1:]] for row in body]
    return read_log(write_rows(tmp_path / "log.csv", head, body), NAMES, UNITS)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("few", ["9 rows", "at least 16"]),
        ("no number", ["line 6", "column 2 (q1)", "'1.2.3' is not a number"]),
        ("short row", ["line 6", "has 3 values", "5, as in the headings"]),
        ("no time", ["line 1", "no column is the time", "header.stamp.sec"]),
        ("two times", ["2 columns are times", "one column named time"]),
        ("joint missing", ["position of joint 'lift_joint'", "/joint_states/NAME/position"]),
        ("topics", ["2 topics have positions", "/left/state, /right/state", "--topic"]),
        ("topic unknown", ["of the topic '/x'", "'pan', 'lift_joint'"]),
        ("twice", ["2 columns are the position of joint 'pan'"]),
        ("headings only", ["has no rows"]),
        ("empty", ["has no rows"]),
        ("one time", ["samples at 1 times", "at least 16"]),
    ],
)
def test_names_what_log_lacks(tmp_path: Path, change: str, said: list[str]) -> None:
    with pytest.raises(InputError) as error:
        read_changed(tmp_path, change)
    for words in said:
        assert words in str(error.value)


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
