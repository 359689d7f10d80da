"""Motions in tables: at samples, at knots, and as positions and velocities over time."""

from __future__ import annotations

import csv
import io
import json
import math
from fractions import Fraction

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motions import hermite_data, motion
from scipy.interpolate import CubicHermiteSpline

from knotwork import Plan
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import ExportError, InputError
from knotwork.files.export import content, motion_table
from sweeps import examples

QUANTITIES = ("position", "velocity", "acceleration", "jerk")


def from_csv(text: str) -> dict[str, np.ndarray]:
    head, *rows = csv.reader(io.StringIO(text))
    values = np.array(rows, dtype=float)
    assert len(set(head)) == len(head)
    return {name: values[:, i] for i, name in enumerate(head)}


@given(st.floats(0.3, 2000.0))
@examples(8)
def test_the_last_sample_is_the_end_whatever_the_rate(rate: float) -> None:
    columns = from_csv(motion().to_csv(rate=rate))
    time = columns["time_s"]
    assert time[0] == motion().start_time
    assert time[-1] == motion().end_time
    assert np.diff(time)[:-1] == pytest.approx(np.full(time.size - 2, 1 / rate))
    assert 0.0 < time[-1] - time[-2] <= (1 + 1e-5) / rate
    for order, quantity in enumerate(QUANTITIES):
        unit = ("", "_per_s", "_per_s2", "_per_s3")[order]
        for i, (name, base) in enumerate((("a", "rad"), ("b", "rad"), ("slide", "m"))):
            assert (columns[f"{name}.{quantity}_{base}{unit}"] == motion()(time, order)[:, i]).all()


def test_methods_refuse_options_of_other_formats() -> None:
    with pytest.raises(InputError, match="'csv' takes no option 'degrees'; formats that do: pvt"):
        motion().to_csv(degrees=True)


def test_all_four_say_the_same(deburring: Plan) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    given = {"rate": 30.0, "robot": deburring.joints.robot}
    trajectory = deburring.trajectory
    columns = from_csv(trajectory.to_csv(**given))
    table = parquet.read_table(io.BytesIO(trajectory.to_parquet(**given)))
    assert table.column_names == list(columns)
    for name, values in columns.items():
        assert (table[name].to_numpy() == values).all()
    arrays = np.load(io.BytesIO(trajectory.to_npz(**given)), allow_pickle=False)
    data = json.loads(trajectory.to_json(**given))
    assert tuple(arrays["joint_names"]) == trajectory.joint_names == tuple(data["joint_names"])
    assert data["units"]["joints"] == list(arrays["joint_units"]) == ["rad"] * 6
    assert data["time"] == arrays["time"].tolist() == columns["time_s"].tolist()
    plural = ("positions", "velocities", "accelerations", "jerks")
    for quantity, many in zip(QUANTITIES, plural, strict=True):
        assert data[many] == arrays[quantity].tolist()
        shown = [name for name in columns if f".{quantity}_" in name and "tool." not in name]
        assert np.column_stack([columns[n] for n in shown]).tolist() == data[many]
    for key in ("tool_position", "tool_quaternion", "tool_linear_velocity"):
        assert data[key] == arrays[key].tolist()


def test_the_tool_is_where_pinocchio_says(deburring: Plan) -> None:
    robot = deburring.joints.robot
    arrays = np.load(io.BytesIO(deburring.trajectory.to_npz(rate=20, robot=robot)))
    turns = arrays["tool_quaternion"]
    assert np.linalg.norm(turns, axis=1) == pytest.approx(np.ones(len(turns)), abs=1e-14)
    assert (np.einsum("ij,ij->i", turns[1:], turns[:-1]) > 0).all()
    for i, q in enumerate(arrays["position"]):
        pose = robot.forward(q)
        assert arrays["tool_position"][i] == pytest.approx(pose.translation, abs=1e-15)
        rotation = pin.Quaternion(turns[i]).toRotationMatrix()
        assert rotation == pytest.approx(pose.rotation, abs=1e-12)
    time, h = arrays["time"][1:-1], 1e-5
    curve = deburring.trajectory
    moved = [
        robot.forward(curve(t + h)).translation - robot.forward(curve(t - h)).translation
        for t in time
    ]
    assert arrays["tool_linear_velocity"][1:-1] == pytest.approx(
        np.array(moved) / (2 * h), abs=1e-7
    )
    turned = [
        pin.log3(robot.forward(curve(t + h)).rotation @ robot.forward(curve(t - h)).rotation.T)
        for t in time
    ]
    assert arrays["tool_angular_velocity"][1:-1] == pytest.approx(
        np.array(turned) / (2 * h), abs=1e-7
    )


@pytest.mark.parametrize("planner", ["modified-hermite", "cubic"])
def test_knots_are_the_whole_motion(planner: str) -> None:
    arrays = np.load(io.BytesIO(motion(planner).to_npz(knots_only=True)))
    assert set(arrays) == {"time", "position", "velocity", "joint_names", "joint_units", "planner"}
    at = np.linspace(motion().start_time, motion().end_time, 3000)
    curve = CubicHermiteSpline(arrays["time"], arrays["position"], arrays["velocity"])
    assert curve(at) == pytest.approx(motion(planner)(at), abs=1e-14)
    assert curve(at, 1) == pytest.approx(motion(planner)(at, 1), abs=1e-12)


def test_knots_of_a_quintic() -> None:
    with pytest.raises(ExportError):
        motion("quintic").to_csv(knots_only=True)
    columns = from_csv(motion("quintic").to_csv(knots_only=True, accelerations=True))
    assert len(columns["time_s"]) == 5
    assert (
        columns["b.acceleration_rad_per_s2"] == motion("quintic").knots.acceleration[:, 1]
    ).all()


@pytest.mark.parametrize(
    "options",
    [
        {"rate": 10, "knots_only": True},
        {"accelerations": True},
        {"tolerance": 1e-3},
        {"rate": 0},
        {"rate": 1e9},
        {"rate": "fast"},
        {"robot": "ur5"},
    ],
)
def test_options_that_can_not_be(options: dict) -> None:
    with pytest.raises(InputError):
        motion().to_csv(**options)


def test_a_robot_of_other_joints(deburring: Plan) -> None:
    with pytest.raises(InputError, match=r"slide"):
        motion().to_csv(robot=deburring.joints.robot)


def test_parquet_without_pyarrow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"knotwork\[parquet\]"):
        motion().to_parquet()


def test_files_of_one_motion_are_the_same() -> None:
    for name in ("csv", "json", "npz", "mat", "scipy", "ros2", "pvt"):
        assert content(motion(), name) == content(motion(), name)


@pytest.mark.parametrize("make", ["to_csv", "to_json", "to_npz"])
def test_refuses_too_many_samples_with_a_rate(monkeypatch: pytest.MonkeyPatch, make: str) -> None:
    monkeypatch.setattr("knotwork.files.export.table.MAX_TABLE_VALUES", 13 * 20_000)
    with pytest.raises(InputError, match="at most 20000 are taken") as caught:
        getattr(motion(), make)(rate=1e5)
    accepted = float(str(caught.value).split(" Hz is accepted")[0].split()[-1])
    time = motion_table(motion(), rate=accepted).time
    assert 0.99 * 20_000 < time.size <= 20_000


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
    curve = CubicHermiteSpline(rows[:, 0], rows[:, 1::2], rows[:, 2::2])
    own = np.clip(at + trajectory.start_time, trajectory.start_time, trajectory.end_time)
    assert curve(at) == pytest.approx(trajectory(own), abs=1e-11)
    assert curve(at, 1) == pytest.approx(trajectory(own, 1), abs=1e-9)


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
    assert "+ 100" in about


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
    with pytest.raises(InputError, match=r"scale of joint 'a' is .*, which is too large"):
        motion().to_pvt(scale={"a": 1e308}, degrees=True)
