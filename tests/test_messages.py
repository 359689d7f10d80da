"""What is wrong in a file is said in our own words: every key with every kind of wrong value."""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from command_line import Command
from knotwork import load_robot, plan
from knotwork.errors import DocumentError, KnotworkError, OutOfReachError
from knotwork.robot.file import RobotFile
from knotwork.scenario import load_scenario
from knotwork.task import Task
from shipped import ROBOT_FILES, SCENARIO_FILES

POSE = {"position": [0.4, 0.1, 0.4], "rpy": [0, 0, 0]}
AHEAD = {"position": [0.4, 0.2, 0.4], "rpy": [0, 0, 0]}
TURNED = {"position": [0.5, 0.2, 0.4], "euler": {"order": "ZYX", "angles": [0, 0, 0]}}
UR5 = load_robot("ur5").urdf.parents[1]
SRDF = UR5 / "srdf" / "ur5.srdf"
TURNING = Path(__file__).parent / "moving" / "turning.csv"
MESH = UR5 / "meshes" / "ur5" / "collision" / "base.stl"
# Together they hold every key that a scenario file may have.
SCENARIOS: dict[str, dict[str, Any]] = {
    "poses": {
        "name": "task",
        "description": "a task",
        "units": {"length": "m", "angle": "rad"},
        "robot": "ur5",
        "tool": {
            "frame": "tool0",
            "offset": {"position": [0, 0, 0.1], "rpy": [0, 0, 0]},
            "mass": 1.5,
            "centre_of_mass": [0, 0, 0.05],
            "inertia": {"ixx": 1, "iyy": 1, "izz": 1, "ixy": 0, "ixz": 0, "iyz": 0},
            "free": {"turn": "z", "tilt": 0.1},
        },
        "gravity": [0, 0, -9.81],
        "frames": {
            "a": {"position": [0, 0, 0], "rotation_vector": [0, 0, 0.1]},
            "b": {"in": "a", "position": [0, 0, 0], "quaternion_xyzw": [0, 0, 0, 1]},
            "belt": {
                "position": [0, 0, 0],
                "moves": {"linear": [0, 0.1, 0], "angular": [0, 0, 0.1], "at": 1},
            },
            "table": {"position": [0, 0, 0], "moves": {"file": str(TURNING)}},
            "arm": {"on": "forearm_link", "position": [0, 0, 0]},
        },
        "frame": "a",
        "outputs": {"arc": 3},
        "start": "home",
        "near": "home",
        "branch": {"shoulder": "left", "elbow": "up", "wrist": "flip"},
        "prefer": "clearance",
        "pull_to_middle": 1.0,
        "planner": "modified-hermite",
        "knots": {"balanced": 0.3},
        "end_acceleration": {"start": {"elbow_joint": 0}, "end": {"elbow_joint": 0}},
        "limits": {
            "velocity": 3.0,
            "jerk": {"elbow_joint": 9},
            "position": {"elbow_joint": [0, 1]},
            "tool_speed": 1.0,
            "tool_acceleration": 9.0,
            "frame_speed": {"frame": "forearm_link", "speed": 1.0},
            "singular_value": 0.01,
        },
        "tolerances": dict.fromkeys(
            [
                *("position", "orientation", "linear_velocity", "angular_velocity"),
                *("joint_position", "joint_velocity", "joint_acceleration"),
            ],
            1e-5,
        ),
        "continuity": 2,
        "rate": 100,
        "waypoints": [
            {"name": "a", "time": 1, "pose": POSE, "stop": True, "do": {"arc": "on"}},
            {"after": 1, "frame": "b", "pose": AHEAD, "speed": 0.1},
            {
                "after": 1,
                "pose": TURNED,
                "velocity": {"linear": [0, 0.1, 0], "angular": [0, 0, 0], "in": "base"},
            },
            {
                "after": 1,
                "pose": {
                    "position": [0.5, 0.2, 0.4],
                    "rotation_matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
                },
                "do": [{"output": 2, "value": True}, {"wait": 0.2}, {"arc": False, "before": 0.1}],
            },
            {
                "after": 1,
                "pose": {"position": [0.4, 0.2, 0.4], "quaternion_wxyz": [1, 0, 0, 0]},
            },
        ],
    },
    "paths": {
        "robot": "ur5",
        "frames": {"tilted": {"position": [0, 0, 0], "rpy": [0.1, 0, 0]}},
        "prefer": {"elbow_joint": 0.5},
        "path": {"acceleration": 0.5},
        "tolerances": dict.fromkeys(["path", "path_orientation", "path_speed"], 1e-3),
        "waypoints": [
            {"pose": POSE, "orientation_in": "tilted"},
            {"along": "line", "speed": 0.1, "blend": 0.01, "pose": {"position": [0.4, 0.2, 0.4]}},
            {
                "along": "line",
                "speed": 0.1,
                "wait": 0.2,
                "do": [{"glue": 2, "at": -0.01}, {"glue": 3, "after": 0.1}],
                "pose": {"position": [0.5, 0.2, 0.4]},
            },
            {
                "along": {"arc": {"through": [0.55, 0.25, 0.4]}},
                "orientation": "tangent",
                "speed": 0.1,
                "stop": True,
                "pose": {"position": [0.5, 0.3, 0.4]},
            },
            {
                "along": {"arc": {"centre": [0.5, 0.25, 0.4], "normal": [0, 0, 1], "turns": 1}},
                "after": 9,
                "stop": True,
                "pose": {"position": [0.5, 0.2, 0.4]},
            },
            {
                "along": {"arc": {"radius": 0.06, "normal": [0, 0, 1], "large": True}},
                "speed": 0.1,
                "stop": True,
                "pose": {"position": [0.5, 0.3, 0.4]},
            },
            {
                "along": {"points": [[0.5, 0.35, 0.4], [0.45, 0.4, 0.4]]},
                "speed": 0.1,
                "stop": True,
                "pose": {"position": [0.4, 0.4, 0.4]},
            },
            {
                "after": 1,
                "stop": True,
                "pose": {
                    "position": [0.4, 0.4, 0.4],
                    "torch": {
                        "seam": [1, 0, 0],
                        "normal": [0, 0, 1],
                        "work_angle": 0.1,
                        "travel_angle": 0.1,
                        "tangent": "x",
                    },
                },
            },
            {
                "along": "line",
                "speed": 0.05,
                "orientation": {"normal": [0, 0, 1], "work_angle": 0.1, "travel_angle": 0.1},
                "weave": {
                    "shape": "triangle",
                    "width": 0.003,
                    "frequency": 2,
                    "dwell": 0.1,
                    "rounding": 0.0005,
                    "in": ["across"],
                    "normal": [0, 0, 1],
                },
                "pose": {"position": [0.5, 0.4, 0.4]},
            },
        ],
    },
    "scene": {
        "robot": "ur5",
        "tool": {
            "shape": [
                {"cylinder": {"radius": 0.03, "length": 0.1}, "position": [0, 0, 0.05]},
                {"capsule": {"radius": 0.03, "length": 0.1}, "rpy": [0, 0, 0]},
            ],
            "holds": {"nut": {"from": "a", "to": "b", "sphere": 0.01, "allow": ["stand"]}},
        },
        "scene": {
            "margin": 0.01,
            "robots": {
                "left": {
                    "scenario": "ur5_deburring",
                    "motion": str(TURNING),
                    "position": [2, 0, 0],
                    "delay": 0.5,
                }
            },
            "objects": {
                "floor": {"half_space": {"normal": [0, 0, 1], "offset": -0.5}},
                "stand": {"box": [0.1, 0.1, 0.1], "in": "base", "position": [1, 1, 0]},
                "tip": {"cone": {"radius": 0.03, "length": 0.1}, "visual": True},
                "egg": {"ellipsoid": [0.1, 0.1, 0.2], "position": [1, 0, 0]},
                "scan": {
                    "points": {"file": str(MESH), "scale": 1.0, "resolution": 0.01},
                    "position": [3, 0, 0],
                },
                "part": {"mesh": str(MESH), "scale": 1.0, "exact": False, "position": [2, 0, 0]},
            },
        },
        "collisions": {
            "self": True,
            "ignore": [["forearm_link", "wrist_3_link"]],
            "resolution": 1e-4,
        },
        "waypoints": [
            {"name": "a", "joints": "home"},
            {"name": "b", "joints": "home", "after": 1},
        ],
    },
    "free": {
        "robot": "ur5",
        "times": "fastest",
        "duration": 5.0,
        "objective": {
            "time": 0,
            "jerk": 1,
            "effort": 1,
            "acceleration": 0.5,
            "peak_jerk": 0,
            "peak_acceleration": 0,
        },
        "limits": {"acceleration": 5.0, "margin": 0.9},
        "waypoints": [
            {
                "pose": POSE,
                "near": "home",
                "free": {"position": {key: [-0.1, 0.1] for key in "xyz"}},
            },
            {"after": {"fastest": True, "at_least": 0.5}, "pose": AHEAD, "velocity": "free"},
            {"pose": TURNED, "speed": {"at_most": 0.5}},
            {"after": "fastest", "pose": POSE},
            {"along": "line", "speed": {"at_most": 0.1}, "pose": {"position": [0.4, 0.2, 0.4]}},
        ],
    },
    "ways": {
        "robot": "ur5",
        "limits": {"acceleration": 5.0},
        "ways": "clear",
        "waypoints": [
            {"joints": "home"},
            {"joints": "home", "way": {"clear": True, "tries": 2, "room": 0.002}},
        ],
    },
    "repeats": {
        "robot": "ur5",
        "start": "home",
        "frames": {
            "pallet": {
                "position": [0.4, 0, 0.2],
                "grid": {"counts": [2, 1, 1], "pitches": [0.1, 0.1, 0.1]},
            }
        },
        "waypoints": [
            {
                "over": "pallet",
                "holds": {"box": {"from": "pick", "to": "put", "sphere": 0.01, "appears": "pick"}},
                "repeat": [
                    {"name": "pick", "joints": "home", "after": 1, "stop": True},
                    {
                        "name": "put",
                        "after": 1,
                        "frame": "place",
                        "pose": {"position": [0, 0, 0], "rpy": [0, 0, 0]},
                        "stop": True,
                    },
                ],
            },
        ],
    },
    "joints": {
        "joint_units": {"j": "rad", "k": "m"},
        "start": {"j": 0, "k": 0},
        "knots": [0.1, 0.5],
        "planner_options": {
            "accelerations": [{"j": 0, "k": 0}, {"j": 0, "k": 0}],
        },
        "limits": {"acceleration": {"j": 3}, "effort": 3},
        "chosen": [
            {
                "times": [0, 0.1, 0.5, 1],
                "accelerations": {"j": [0, 1, 2, 0], "k": [0, 1, 2, 0]},
                "velocities": {"waypoint 1": {"j": 0, "k": 0}},
            }
        ],
        "waypoints": [{"joints": {"j": 1, "k": 0.1}, "velocity": {"j": 0}, "time": 1}],
    },
}
ROBOTS: dict[str, dict[str, Any]] = {
    "planar2": {
        "name": "arm",
        "description": "an arm",
        "urdf": str(ROBOT_FILES / "planar2.urdf"),
        "base_frame": "base",
        "tool_frame": "tip",
        "package_paths": ["/opt/meshes"],
        "external_axes": {
            "rail": {"carries": "robot", "slides": [1, 0, 0], "range": [0, 1], "velocity": 1.0},
            "table": {"in": "cell", "turns": [0, 0, 1], "position": [1, 0, 0], "rpy": [0, 0, 1]},
            "other": {"urdf": str(ROBOT_FILES / "planar2.urdf"), "position": [1, 0, 0]},
        },
        "locked": {},
        "configurations": {"home": {"shoulder": 0.1, "elbow": 0.2}},
        "collision": {"ignore": [["base", "forearm"]], "srdf": str(SRDF)},
        "limits": {
            "position": {"elbow": [-1, 1]},
            "velocity": 2.0,
            "acceleration": {"elbow": 2.0},
            "jerk": 50,
            "effort": {"elbow": 2.0},
        },
    },
}
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


def field(place: Place) -> str:
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place)
    return text.removeprefix(".")


def said(kind: str, mapping: Any) -> KnotworkError | None:
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
        assert said(kind, mapping) is None
    schema = model.model_json_schema()
    parts = [schema, *schema["$defs"].values()]
    keys = {key for part in parts for key in part.get("properties", {})}
    assert keys <= {key for file in files.values() for place in places(file) for key in place}


def check_words(kind: str, data: dict[str, Any], place: Place, wrong: Any) -> bool:
    """Whether one wrong value is refused; if it is, what is said must be right."""
    error = said(kind, changed(data, place, wrong))
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
    sample = CASES[::9]
    assert sweep(sample) > 10 * len(sample)


@pytest.mark.exhaustive
def test_every_wrong_value_of_every_key_is_refused_in_our_own_words() -> None:
    assert sweep(CASES) > 10 * len(CASES)


@pytest.mark.parametrize(
    ("place", "value", "says"),
    [
        (
            ("waypoints", 2, "velocity"),
            [0, 60, 0],
            "waypoints[2].velocity: [0, 60, 0]: must be a mapping of linear, "
            "angular and in, or free",
        ),
        (
            ("waypoints", 0, "pose", "position"),
            [450, 80],
            "waypoints[0].pose.position: [450, 80]: has 2 values, fewer than 3 "
            "(origin: x, y, z [length])",
        ),
        (
            ("waypoints", 0, "pose", "position"),
            [450, 80, 1, 2],
            "[450, 80, 1, 2]: has 4 values, more than 3 (origin: x, y, z [length])",
        ),
        (
            ("waypoints", 0, "stop"),
            "yes",
            "waypoints[0].stop: 'yes' is text in YAML 1.2: must be true, or left out",
        ),
        (("waypoints", 0, "stop"), False, "waypoints[0].stop: false: must be true, or left out"),
        (("waypoints", 0, "time"), "2 s", "waypoints[0].time: '2 s': must be a number"),
        (("rate",), None, "rate: has no value: must be a number (samples per second"),
        (("rate",), -3, "rate: -3: must be greater than 0"),
        (("units", "length"), "cm", "units.length: 'cm': must be 'm' or 'mm'"),
        (("units",), "mm", "units: 'mm': must be a mapping (accepted: length, angle)"),
        (("name",), 3, "name: 3: must be text; put it in quotes"),
        (("robot",), "", "robot: '': must not be empty"),
        (("frames",), ["a"], "frames: ['a']: must be a mapping (named frames,"),
        (
            ("limits", "position", "elbow_joint"),
            [1, 0],
            "limits.position.elbow_joint: [1, 0]: lower limit 1 must be less than upper limit 0",
        ),
        (
            ("planner_options",),
            {"accelerations": []},
            "planner_options.accelerations: []: is empty (zero, estimated, or a mapping by joint",
        ),
        (
            ("waypoints",),
            [],
            "waypoints: []: is empty (two at least, or one after a start, in order",
        ),
        (("waypoints", 1), {"after": 1}, "waypoints[1]: must be a mapping with either pose or"),
        (("waypoints", 1), 5, "waypoints[1]: 5: must be a mapping with either pose or joints"),
    ],
)
def test_a_slip_is_named_with_what_is_accepted(place: Place, value: Any, says: str) -> None:
    error = said("scenario", changed(SCENARIOS["poses"], place, value))
    assert isinstance(error, DocumentError)
    assert says in str(error)


def test_one_wrong_value_is_one_problem() -> None:
    for value in ("fast", [1], {"elbow": "fast"}):
        error = said("robot", changed(ROBOTS["planar2"], ("limits", "velocity"), value))
        assert isinstance(error, DocumentError)
        assert len(error.problems) == 1
        assert error.problems[0].field.startswith("limits.velocity")


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
        ("arm.urdf.xacro", XACRO, "is xacro, not yet a URDF; expand it with `xacro"),
        ("arm.xacro", XACRO, "arm.xacro > arm.urdf`"),
        ("arm.urdf", XACRO, "is xacro"),
        ("arm.sdf", SDF, "is SDF, which is not supported"),
        ("arm.xml", MJCF, "is MJCF (MuJoCo), which is not supported"),
        ("arm.xml", "<html/>", "outermost element is <html>"),
        ("arm.usd", "PXR-USDC", "a URDF"),
    ],
)
def test_other_robot_formats_are_named_with_what_to_do(
    name: str, text: str, says: str, inline: bool, tmp_path, knotwork: Command
) -> None:
    (tmp_path / name).write_text(text)
    robot = f"{{urdf: {name}, tool_frame: tip}}" if inline else name
    task = tmp_path / "task.yaml"
    task.write_text(
        f"robot: {robot}\nwaypoints:\n- pose: {{position: [0, 0, 0], rpy: [0, 0, 0]}}\n"
        "- pose: {position: [0, 0, 1], rpy: [0, 0, 0]}\n  after: 1\n"
    )
    ran = knotwork("plan", task)
    assert ran.code == 2
    assert says in ran.err
    assert "URDF" in ran.err
    assert "task.yaml: line 1: robot" in ran.err
    assert "not valid YAML" not in ran.err


def test_any_file_with_a_robot_element_is_a_urdf(tmp_path) -> None:
    path = tmp_path / "arm.xml"
    path.write_bytes((ROBOT_FILES / "planar2.urdf").read_bytes())
    assert load_robot(path).joint_names == ("shoulder", "elbow")


def test_a_robot_without_tool_frame_is_named_with_file_key_and_frames(
    tmp_path, knotwork: Command
) -> None:
    urdf = ROBOT_FILES / "planar2.urdf"
    task = tmp_path / "task.yaml"
    task.write_text(
        f"units: {{length: m}}\nrobot: {urdf}\nwaypoints:\n"
        "- {joints: {shoulder: 0, elbow: 1}, time: 0}\n"
        "- {pose: {position: [0.6, 0, 0], rpy: [0, 0, 0]}, time: 1}\n"
    )
    ran = knotwork("plan", task)
    assert ran.code == 2
    assert "task.yaml: line 2: robot" in ran.err
    assert "tool: {frame: NAME}" in ran.err
    assert "tool_frame: NAME" in ran.err
    assert "tip" in ran.err
    assert "forearm" in ran.err
    assert "the Jacobian needs" not in ran.err


def test_joint_values_need_no_tool_frame(tmp_path) -> None:
    urdf = ROBOT_FILES / "planar2.urdf"
    ends = [{"joints": {"shoulder": t, "elbow": 1}, "time": t} for t in (0, 1)]
    assert plan({"robot": str(urdf), "waypoints": ends}).report.ok


def test_a_robot_without_tool_frame_has_one_once_the_scenario_names_it(tmp_path) -> None:
    urdf = ROBOT_FILES / "planar2.urdf"
    ends = [{"joints": {"shoulder": t, "elbow": 1}, "time": t} for t in (0, 1)]
    assert plan({"robot": str(urdf), "tool": {"frame": "tip"}, "waypoints": ends}).report.ok


@pytest.mark.parametrize(
    ("units", "position", "hint"),
    [
        ("{angle: deg}", "[450, -150, 200]", "514.8 m from the base of an arm that reaches"),
        ("{angle: deg}", "[450, -150, 200]", "units: {length: mm}"),
        ("{angle: deg, length: mm}", "[0.45, -0.15, 0.2]", "0.5148 mm from the base"),
        ("{angle: deg, length: mm}", "[0.45, -0.15, 0.2]", "units: {length: m}"),
        ("{angle: deg}", "[2.5, -0.15, 0.2]", None),
        ("{angle: deg, length: mm}", "[4500, -150, 200]", None),
        ("{angle: deg, length: mm}", "[20, 10, 5]", None),
    ],
)
def test_lengths_in_the_wrong_unit_are_suspected_where_the_arm_does_not_reach(
    units: str, position: str, hint: str | None, tmp_path, knotwork: Command
) -> None:
    task = tmp_path / "task.yaml"
    task.write_text(
        f"robot: ur5\nunits: {units}\nstart: home\nwaypoints:\n"
        f"- {{pose: {{position: {position}, rpy: [180, 0, 0]}}, after: 2}}\n"
    )
    ran = knotwork("plan", task)
    assert ran.code == 2
    assert "task.yaml: line 5: waypoints[0]: waypoint 1: the pose is out of" in ran.err
    if hint is None:
        assert "units" not in ran.err
    else:
        assert hint in ran.err


def test_a_tool_in_the_wrong_unit_too_hides_no_slip(tmp_path, knotwork: Command) -> None:
    given = SCENARIO_FILES["ur5_deburring"].read_text()
    task = tmp_path / "task.yaml"
    task.write_text(given.replace("units: {length: mm, angle: deg}", "units: {angle: deg}"))
    ran = knotwork("plan", task)
    assert ran.code == 2
    assert "units: {length: mm}" in ran.err


def test_a_file_that_is_not_there_is_no_scenario(knotwork: Command) -> None:
    ran = knotwork("plot", "missing.yaml", "-s", "ur5_deburring")
    assert ran.code == 2
    assert "there is no file missing.yaml" in ran.err


@pytest.mark.parametrize(
    ("position", "angle", "says"),
    [
        ("[950, 0, 0]", 0, r"the nearest point found is 50 mm away .* pose 50 mm"),
        (
            "[103.69241831521295, 784.454463134221, 0]",  # shoulder 1 rad, elbow 1 rad
            math.degrees(2.0),
            r"shoulder at 57.2958 deg, outside \[-15, 15\]",
        ),
        ("[900, 0, 0]", 60, r"the nearest found is off by 60 deg"),
    ],
)
def test_poses_out_of_reach_are_told_in_the_units_of_the_file(
    position: str, angle: float, says: str
) -> None:
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


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("waypoints: [{joints: home, time: 0}, {joints: {a: 1}, after: 1}]", "waypoints[0].joints"),
        ("waypoints: [{joints: {a: 1}, time: 0}, {joints: home, after: 1}]", "waypoints[1].joints"),
        ("{start: home, waypoints: [{joints: {a: 1}, after: 1}]}", "start"),
    ],
)
def test_a_named_configuration_without_a_robot_is_an_error(
    text: str, place: str, tmp_path, knotwork: Command
) -> None:
    (tmp_path / "task.yaml").write_text(text)
    ran = knotwork("plan", tmp_path / "task.yaml")
    assert ran.code == 2
    assert f"{place}: configuration 'home' needs a robot" in ran.err
