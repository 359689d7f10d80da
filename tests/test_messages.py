"""Errors in files have messages of our own: every key with every kind of wrong value."""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from cases import cases
from command_line import Command
from knotwork import load_robot, plan
from knotwork.errors import DocumentError, KnotworkError, OutOfReachError
from knotwork.robot.robot_file import RobotFile
from knotwork.task import Task
from knotwork.task.scenario import load_scenario
from shipped import ROBOT_FILES
from texts import written

UR5 = load_robot("ur5").urdf.parents[1]
SRDF = UR5 / "srdf" / "ur5.srdf"
MESH = UR5 / "meshes" / "ur5" / "collision" / "base.stl"
TURNING = Path(__file__).parent / "moving" / "turning.csv"
FILES = cases(
    __file__, SRDF_FILE=SRDF, TURNING_FILE=TURNING, MESH_FILE=MESH, ROBOT_FILES=ROBOT_FILES
)
SCENARIOS, ROBOTS = FILES["scenarios"], FILES["robots"]
WRONG: tuple[Any, ...] = (
    *(None, True, "yes", "", "1 m", 3, -1, 0, 1.5, math.nan, math.inf, 1e300, 10**400),
    *([], [0], [0, 60, 0], [1, 2, 3, 4, 5], ["a", None], [[1, 2], [3]], [{}]),
    *({}, {"x": 1}, {1: 2}, {"position": 3}, {"a": {"b": []}}),
)
PYDANTIC = re.compile(
    r"valid (dictionary|list|string|number|integer|tuple|boolean)|after validation|instance of"
    r"|[Ii]nput|[Ss]hould\b|[Vv]alue error|unable to|discriminator|union|pydantic|\btag\b|NoneType"
    r"|dict\b|\bTrue\b|\bFalse\b|\bNone\b|traceback|_error|_type",
)

Place = tuple[str | int, ...]


def places(data: Any, place: Place = ()) -> Iterator[Place]:
    """Every key and index below some data."""
    inner = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in inner:
        yield (*place, key)
        if isinstance(value, dict | list):
            yield from places(value, (*place, key))


def changed(data: Any, place: Place, value: Any) -> Any:
    whole = copy.deepcopy(data)
    inner = whole
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    return whole


def refusal(kind: str, mapping: Any) -> KnotworkError | None:
    """The error that a scenario or robot gives, if it gives one."""
    try:
        if kind == "scenario":
            load_scenario(mapping)
        else:
            load_robot(mapping)
    except KnotworkError as error:
        return error
    return None


CASES = [
    (kind, name, place)
    for kind, files in (("scenario", SCENARIOS), ("robot", ROBOTS))
    for name, file in files.items()
    for place in places(file)
]


@pytest.mark.parametrize(
    ("kind", "files", "model"),
    [("scenario", SCENARIOS, Task), ("robot", ROBOTS, RobotFile)],
)
def test_the_files_are_right_and_hold_every_key_of_the_schema(kind, files, model) -> None:
    for mapping in files.values():
        assert refusal(kind, mapping) is None
    schema = model.model_json_schema()
    parts = [schema, *schema["$defs"].values()]
    keys = {key for part in parts for key in part.get("properties", {})}
    assert keys <= {key for file in files.values() for place in places(file) for key in place}


def test_units_are_data_of_the_schema_and_end_the_first_clause_of_descriptions() -> None:
    speed = Task.model_json_schema()["$defs"]["PathWaypoint"]["properties"]["speed"]
    assert speed["unit"] == "length/s"
    assert speed["description"].partition(";")[0] == "Speed of the TCP along the path [length/s]"


def check_words(kind: str, data: dict[str, Any], place: Place, wrong: Any) -> bool:
    """Whether one wrong value is refused; if it is, the message must be right."""
    error = refusal(kind, changed(data, place, wrong))
    if error is None:
        return False
    text = str(error)
    own = text.replace("[True]", "")
    assert not PYDANTIC.search(own), text
    text.encode("utf-8")
    if isinstance(error, DocumentError):
        for problem in error.problems:
            assert problem.field
            assert problem.message
            assert len(str(problem)) < 700
    return True


def sweep(cases: list[tuple[str, str, Place]]) -> int:
    files = {"scenario": SCENARIOS, "robot": ROBOTS}
    return sum(
        check_words(kind, files[kind][name], place, wrong)
        for kind, name, place in cases
        for wrong in WRONG
    )


def test_wrong_values_are_refused_in_our_own_words() -> None:
    sample = CASES[::18]
    assert sweep(sample) > 10 * len(sample)


@pytest.mark.exhaustive
def test_every_wrong_value_of_every_key_is_refused_in_our_own_words() -> None:
    assert sweep(CASES) > 10 * len(CASES)


XACRO = (
    '<?xml version="1.0"?>\n<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    '<xacro:property name="l" value="1"/><link name="base"/></robot>'
)
SDF = '<?xml version="1.0"?>\n<sdf version="1.9"><model name="a"/></sdf>'
MJCF = '<mujoco model="a"><worldbody/></mujoco>'


@pytest.mark.parametrize("inline", [False, True])
@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("arm.urdf.xacro", XACRO, "is xacro; expand it with `xacro"),
        ("arm.xacro", XACRO, "arm.xacro > arm.urdf`"),
        ("arm.urdf", XACRO, "is xacro"),
        ("arm.sdf", SDF, "is SDF, which is not supported"),
        ("arm.xml", MJCF, "is MJCF (MuJoCo), which is not supported"),
        ("arm.xml", "<html/>", "outermost element is <html>"),
        ("arm.usd", "PXR-USDC", "is not a valid URDF"),
    ],
)
def test_other_robot_formats_are_named_with_what_to_do(
    name: str, text: str, says: str, inline: bool, tmp_path, knotwork: Command
) -> None:
    (tmp_path / name).write_text(text)
    robot = f"{{urdf: {name}, tool_frame: tip}}" if inline else name
    task = written(
        tmp_path / "task.yaml",
        f"robot: {robot}\nwaypoints:\n- pose: {{position: [0, 0, 0], rpy: [0, 0, 0]}}\n"
        "- pose: {position: [0, 0, 1], rpy: [0, 0, 0]}\n  after: 1\n",
    )
    err = knotwork("plan", task).refused()
    assert says in err
    assert "URDF" in err
    assert "task.yaml: line 1: robot" in err
    assert "not valid YAML" not in err


@pytest.mark.parametrize(
    ("position", "angle", "says"),
    [
        ("[950, 0, 0]", 0, r"the nearest point found is 50 mm away"),
        (
            "[103.69241831521295, 784.454463134221, 0]",  # shoulder 1 rad, elbow 1 rad
            math.degrees(2.0),
            r"shoulder at 57.2958 deg, outside \[-15, 15\]",
        ),
        ("[900, 0, 0]", 60, r"the nearest orientation found there is off by 60 deg"),
    ],
)
def test_poses_out_of_reach_have_units_of_file(position: str, angle: float, says: str) -> None:
    task = {
        "robot": "planar2",
        "units": {"length": "mm", "angle": "deg"},
        "limits": {"position": {"shoulder": [-15, 15]}},
        "waypoints": [
            {"joints": {"shoulder": 0, "elbow": 90}},
            {"after": 1, "pose": {"position": yaml.safe_load(position), "rpy": [0, 0, angle]}},
        ],
    }
    with pytest.raises(OutOfReachError, match=says) as caught:
        plan(task)
    assert not re.search(r"\d (m|rad)\b|°", str(caught.value))
