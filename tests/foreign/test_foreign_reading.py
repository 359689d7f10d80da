"""Trajectories of other tools: what is read from them, and what is refused and where."""

from __future__ import annotations

import copy
import json
import math
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.interpolate import BPoly

from cases import cases
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import DocumentError
from knotwork.files.foreign import read_trajectory
from texts import written

REFUSED = cases(__file__)
NAMES, UNITS = ("joint_1", "joint_10", "slide"), ("rad", "rad", "m")
TIME = [0.0, 0.5, 1.25]
Q = [[0.0, 1.0, 0.1], [0.5, -1.0, 0.2], [1.0, 0.0, 0.3]]
V = [[0.0, 0.1, 0.0], [0.2, 0.3, 0.1], [0.0, 0.0, 0.0]]
A = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.5], [0.0, -1.0, 0.0]]
AT = np.linspace(0.0, 1.25, 101)


def read(path: Path, **options: object) -> JointTrajectory:
    trajectory, faults = read_trajectory(path, NAMES, UNITS, **options)  # type: ignore[arg-type]
    assert not faults
    assert trajectory.joint_names == NAMES
    assert trajectory.joint_units == UNITS
    return trajectory


def expected(order: int, nu: int = 0) -> np.ndarray:
    """The curve through the points, with as many derivatives as there are, at the times `AT`."""
    points = list(zip(*(Q, V, A)[:order], strict=True))
    return np.asarray(BPoly.from_derivatives(TIME, points)(AT, nu))


def csv_text(head: list[str], columns: list[np.ndarray], delimiter: str = ",") -> str:
    rows = [delimiter.join(repr(float(v)) for v in row) for row in np.column_stack(columns)]
    return delimiter.join(head) + "\n" + "\n".join(rows) + "\n"


def csv_of(order: int) -> str:
    head, columns = ["time"], [np.array(TIME)]
    labels = ("", ".velocity", ".acceleration")
    for k, data in enumerate((Q, V, A)[:order]):
        for j, name in enumerate(NAMES):
            head.append(name + labels[k])
            columns.append(np.array(data)[:, j])
    return csv_text(head, columns)


def message(order: int, **extra: object) -> dict:
    keys = ("positions", "velocities", "accelerations")
    points = []
    for i, t in enumerate(TIME):
        point: dict = {key: data[i] for key, data in zip(keys[:order], (Q, V, A), strict=False)}
        point["time_from_start"] = {"sec": int(t), "nanosec": round((t - int(t)) * 1e9)}
        points.append(point)
    return copy.deepcopy({"joint_names": list(NAMES), "points": points, **extra})


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("kind", ["csv", "json", "points.json", "yaml"])
def test_interpolates_like_ros2_controller(tmp_path: Path, order: int, kind: str) -> None:
    content: object = message(order)
    if kind == "csv":
        content = csv_of(order)
    elif kind == "json":
        keys = ("positions", "velocities", "accelerations")
        data = dict(zip(keys[:order], (Q, V, A), strict=False))
        content = {"joint_names": NAMES, "time": TIME, **data}
    trajectory = read(written(tmp_path / f"motion.{kind}", content))
    assert trajectory(AT) == pytest.approx(expected(order), abs=1e-12)
    assert trajectory(AT, 1) == pytest.approx(expected(order, nu=1), abs=1e-11)
    assert trajectory.polynomial.degree == 2 * order - 1
    assert ("straight lines", "cubics", "quintics")[order - 1] in trajectory.origin


def test_joints_in_any_order(tmp_path: Path) -> None:
    joints, columns = (2, 0, 1), (5, 1, 0, 6, 3, 2, 4)
    data = message(2)
    data["joint_names"] = [NAMES[j] for j in joints]
    for point in data["points"]:
        for key in ("positions", "velocities"):
            point[key] = [point[key][j] for j in joints]
    file = written(tmp_path / "m.yml", data)
    assert read(file)(AT) == pytest.approx(expected(2), abs=1e-13)
    rows = [line.split(",") for line in csv_of(2).splitlines()]
    file = written(tmp_path / "m.csv", "\n".join(",".join(row[c] for c in columns) for row in rows))
    assert read(file)(AT) == pytest.approx(expected(2), abs=1e-13)


@pytest.mark.parametrize(
    ("time", "position", "velocity"),
    [
        ("Time [s]", "{} [rad]", "{} [rad/s]"),
        ("time_s", "{}.position_rad", "{}.velocity_rad_per_s"),
        ("time_from_start", "q.{}", "qd.{}"),
        ("SEC", "position[{}]", "velocity[{}]"),
    ],
)
def test_reads_known_headings(tmp_path: Path, time: str, position: str, velocity: str) -> None:
    def metres(text: str) -> str:
        return text.replace("rad", "m")

    head = [time]
    head += [position.format(n) for n in NAMES[:2]] + [metres(position).format("slide")]
    head += [velocity.format(n) for n in NAMES[:2]] + [metres(velocity).format("slide")]
    columns = [np.array(TIME), *np.array(Q).T, *np.array(V).T]
    for delimiter in (",", ";", "\t"):
        file = written(tmp_path / "m.csv", csv_text(head, columns, delimiter))
        assert read(file)(AT) == pytest.approx(expected(2), abs=1e-13)


@pytest.mark.parametrize(
    ("heading", "factor", "order"),
    [
        ("joint_1 [°/s]", 180 / math.pi, 1),
        ("joint_1.acceleration [deg/s²]", 180 / math.pi, 2),
        ("joint_1 [rad/s^2]", 1.0, 2),
    ],
)
def test_units_name_quantity(heading: str, factor: float, order: int, tmp_path: Path) -> None:
    headings = ["joint_1", "joint_1.velocity_rad_per_s", "joint_1.acceleration_rad_per_s2"]
    headings[order] = heading
    values = np.array([[0.0, 0.5, 0.25], [0.4, -0.5, 0.75]])
    written = values.copy()
    written[:, order] *= factor
    rows = "".join(f"{t},{row[0]},{row[1]},{row[2]}\n" for t, row in enumerate(written.tolist()))
    (tmp_path / "a.csv").write_text(f"time,{','.join(headings)}\n{rows}", encoding="utf-8")
    found, _ = read_trajectory(tmp_path / "a.csv", ["joint_1"], ["rad"])
    for nu in range(3):
        np.testing.assert_allclose(found([0.0, 1.0], nu)[:, 0], values[:, nu], atol=1e-12)


@pytest.mark.parametrize("wrapped", [False, True])
@pytest.mark.parametrize(
    ("units", "words"),
    [
        ({"time": "ms"}, "units.time: is 'ms'; accepted: s, rad or m, or these per s or s²"),
        ({"positions": "deg"}, "units.positions: is 'deg'"),
        ({"velocities": ["rad/s", "deg/s", "m/s"]}, "units.velocities[1]: is 'deg/s'"),
        ({"joints": ["rad", "rad", "mm"]}, "units.joints[2]: is 'mm'"),
        ("deg", "units: is 'deg'"),
    ],
)
def test_refuses_other_units(tmp_path: Path, units: object, words: str, wrapped: bool) -> None:
    data: dict = {"joint_names": list(NAMES), "time": list(TIME), "positions": Q, "velocities": V}
    data = {"trajectory": message(2), "units": units} if wrapped else data | {"units": units}
    file = written(tmp_path / "bad.json", data)
    assert words in str(refused(file))


@pytest.mark.parametrize(
    ("heading", "times", "start"),
    [
        ("time_from_start", TIME, 7.0),
        ("Time from start [ms]", [1e3 * t for t in TIME], 7.0),
        ("time_step_s", [0.0, *np.diff(TIME)], 7.0),
        ("time", TIME, 0.0),
    ],
)
def test_times_of_tables_start_with_the_task(
    tmp_path: Path, heading: str, times: list[float], start: float
) -> None:
    file = tmp_path / "m.csv"
    columns = [np.array(times), *np.array(Q).T, *np.array(V).T]
    head = [heading, *NAMES, *(f"{name}.velocity" for name in NAMES)]
    file.write_text(csv_text(head, columns))
    trajectory = read(file, span=(7.0, 8.25))
    assert (trajectory.start_time, trajectory.end_time) == (start, start + 1.25)
    assert trajectory(start + AT) == pytest.approx(expected(2), abs=1e-13)


def test_units_are_converted(tmp_path: Path) -> None:
    head = ["time_ms", "joint_1 [deg]", "joint_10.position_rad", "slide.position_mm"]
    head += ["joint_1.velocity_deg_per_s", "joint_10 [rad/s]", "slide [mm/s]"]
    q, v = np.array(Q), np.array(V)
    columns = [np.array(TIME) * 1e3, np.degrees(q[:, 0]), q[:, 1], q[:, 2] * 1e3]
    columns += [np.degrees(v[:, 0]), v[:, 1], v[:, 2] * 1e3]
    file = written(tmp_path / "m.csv", csv_text(head, columns))
    assert read(file)(AT) == pytest.approx(expected(2), abs=1e-12)


def test_columns_of_the_tool_are_skipped_beside_a_joint_of_that_name(tmp_path: Path) -> None:
    head = "time_s,tool.position_rad,tool.position_x_m,tool.quaternion_w"
    (tmp_path / "m.csv").write_text(f"{head}\n0,0,5,1\n1,2,6,1\n")
    found, _ = read_trajectory(tmp_path / "m.csv", ["tool"], ["rad"])
    assert found(0.5) == pytest.approx([1.0])


def test_comments_blank_lines_and_byte_order_mark(tmp_path: Path) -> None:
    head, *rows = csv_of(2).splitlines()
    file = tmp_path / "m.csv"
    file.write_text("\ufeff# made by hand\n\n" + head + "\n\n" + "\n# half way\n".join(rows))
    assert read(file)(AT) == pytest.approx(expected(2), abs=1e-13)
    file.write_text("# numpy.savetxt\n# " + head + "\n" + "\n".join(rows))
    assert read(file)(AT) == pytest.approx(expected(2), abs=1e-13)


@pytest.mark.parametrize("key", ["multi_dof_trajectory", "multi_dof_joint_trajectory"])
@pytest.mark.parametrize("inside", [False, True])
def test_refuses_message_with_other_motions(tmp_path: Path, key: str, inside: bool) -> None:
    """A base that drives meanwhile: the motion of the joints alone is not what the robot does."""
    path = tmp_path / "goal.json"
    empty = {"joint_names": [], "points": []}
    base = {"joint_names": ["base"], "points": [{"transforms": [{}], "time_from_start": 0}]}
    for other, moves in ((empty, False), (base, True)):
        goal = {"trajectory": message(2), key: other}
        path.write_text(json.dumps({"goal": goal} if inside else goal))
        if moves:
            says = rf"{key}: moves joints of several degrees of freedom"
            with pytest.raises(DocumentError, match=says):
                read(path)
        else:
            read(path)


@pytest.mark.parametrize("wrap", ["trajectory", "joint_trajectory", "goal"])
def test_messages_inside_others(tmp_path: Path, wrap: str) -> None:
    data = {wrap: message(2, header={"frame_id": ""})}
    if wrap == "goal":
        data = {"goal": {"trajectory": data["goal"], "goal_tolerance": []}}
    file = written(tmp_path / "m.yaml", yaml.safe_dump(data) + "---\n")
    assert read(file)(AT) == pytest.approx(expected(2), abs=1e-13)


def test_times_of_a_message_count_from_the_start_of_the_task(tmp_path: Path) -> None:
    file = written(tmp_path / "m.yaml", message(2))
    trajectory = read(file, span=(7.0, 8.25 + 4e-10))
    assert (trajectory.start_time, trajectory.end_time) == (7.0, 8.25 + 4e-10)
    assert trajectory(7.0 + AT) == pytest.approx(expected(2), abs=1e-13)
    assert read(file, span=(7.0, 8.26)).end_time == 8.25


# refusals


def refused(path: Path) -> DocumentError:
    with pytest.raises(DocumentError) as caught:
        read(path)
    assert str(path) in str(caught.value)
    return caught.value


def replaced(text: str, line: int, column: int, value: str) -> str:
    rows = [row.split(",") for row in text.splitlines()]
    rows[line - 1][column - 1] = value
    return "\n".join(",".join(row) for row in rows)


@pytest.mark.parametrize(("line", "column", "value", "words"), REFUSED["cells"])
def test_csv_that_is_refused(
    tmp_path: Path, line: int, column: int, value: str, words: str
) -> None:
    file = written(tmp_path / "bad.csv", replaced(csv_of(2), line, column, value))
    assert words in str(refused(file))


@pytest.mark.parametrize(("text", "words"), REFUSED["tables"])
def test_csv_of_no_motion(tmp_path: Path, text: str, words: str) -> None:
    file = written(tmp_path / "bad.csv", text)
    assert words in str(refused(file))


def test_files_that_are_no_text(tmp_path: Path) -> None:
    for name in ("a.csv", "a.yaml", "a.json"):
        assert "can't be read" in str(refused(tmp_path / name))
        (tmp_path / name).write_bytes(b"\xff\xfe\x00")
        assert "is not UTF-8" in str(refused(tmp_path / name))


def change(data: dict, where: list, value: object) -> dict:
    inner = data
    for key in where[:-1]:
        inner = inner[key]
    if value == "~":
        del inner[where[-1]]
    else:
        inner[where[-1]] = value
    return data


@pytest.mark.parametrize(("where", "value", "words"), REFUSED["messages"])
def test_yaml_that_is_refused(tmp_path: Path, where: list, value: object, words: str) -> None:
    file = written(tmp_path / "bad.yaml", change(message(3), where, value))
    error = refused(file)
    assert words in str(error)
    line = error.problems[0].line
    if isinstance(value, int | float | str) and value != "~" and "sec" not in where:
        assert yaml.safe_dump(value).split("\n")[0] in file.read_text().splitlines()[line - 1]


@pytest.mark.parametrize(("where", "value", "words"), REFUSED["json"])
def test_json_that_is_refused(tmp_path: Path, where: list, value: object, words: str) -> None:
    data: dict = {"joint_names": list(NAMES), "time": list(TIME)}
    data |= {"positions": [list(row) for row in Q], "velocities": [list(row) for row in V]}
    file = written(tmp_path / "bad.json", change(data, where, value))
    assert words in str(refused(file))


@pytest.mark.parametrize("delimiter", [";", "\t", " "])
@pytest.mark.parametrize("comma", [False, True])
def test_reads_decimal_commas(tmp_path: Path, delimiter: str, comma: bool) -> None:
    file = tmp_path / "motion.csv"
    rows = [["time", *NAMES], *([str(t), *map(str, q)] for t, q in zip(TIME, Q, strict=True))]
    text = "\n".join(delimiter.join(row) for row in rows)
    file.write_text(text.replace(".", ",") if comma else text)
    assert (read(file).position(TIME) == Q).all()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("1" + ",1" * 200_000, "at most 10000 columns"),
        ("\n" * 200_000, "has no rows"),
        ("#\n" * 100_000, "has no rows"),
        ('"' * 200_001, "not valid CSV"),
        ("time" + ",lift" * 9_000 + "\n", "is given twice"),
    ],
)
def test_refuses_tables_in_little_memory(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text)
    tracemalloc.start()
    try:
        with pytest.raises(DocumentError, match=says):
            read_trajectory(tmp_path / "a.csv", ["lift"], ["m"])
        assert tracemalloc.get_traced_memory()[1] < 20_000_000
    finally:
        tracemalloc.stop()


def test_refuses_too_many_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("knotwork.files.documents.csv_rows.MAX_CSV_CELLS", 20)
    monkeypatch.setattr("knotwork.files.storage.trajectory_file.MAX_STORED_VALUES", 20)
    (tmp_path / "a.csv").write_text("time,lift\n" + "0,0\n" * 10)
    with pytest.raises(DocumentError, match="line 11: is too large"):
        read_trajectory(tmp_path / "a.csv", ["lift"], ["m"])
    (tmp_path / "a.json").write_text(f"[{'0,' * 20}0]")
    with pytest.raises(DocumentError, match="more than 20 values"):
        read_trajectory(tmp_path / "a.json", ["lift"], ["m"])
