"""Tasks as Python objects: the same as files, checked when made, never changed."""

from __future__ import annotations

import inspect
from io import StringIO
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.errors import DocumentError
from knotwork.files.documents import Location
from knotwork.files.documents.values import marked
from knotwork.task import (
    Action,
    AlongPoints,
    Arc,
    Collisions,
    Fastest,
    Frame,
    HalfSpace,
    HeldObject,
    JointWaypoint,
    Limits,
    PathWaypoint,
    Placement,
    Pose,
    PoseWaypoint,
    SceneObject,
    SolidOfRevolution,
    Surroundings,
    TaskPart,
    TaskUnits,
    Tool,
    Velocity,
)
from knotwork.task.si_units import unit_at
from shipped import SCENARIO_FILES
from texts import written

FILE = """
robot: ur5
tool:
  offset: {position: [0, 0, 0.12]}
  holds: {nozzle: {from: above, to: away, cylinder: {radius: 0.01, length: 0.03}}}
frames: {part: {in: base, position: [0.4, -0.1, 0.06]}}
frame: part
scene:
  objects: {floor: {half_space: {normal: [0, 0, 1]}, position: [0, 0, -0.2]}}
collisions: {self: false}
start: home
end_acceleration: zero
waypoints:
  - {name: above, time: 2, pose: {position: [0, 0, 0.05], rpy: [3.141592653589793, 0, 0]},
     velocity: {angular: [0, 0, 0.1], in: base}}
  - {name: on, after: 1, pose: {position: [0, 0, 0], rpy: [3.141592653589793, 0, 0]}, wait: 0.2}
  - {name: end, along: line, speed: 0.04, pose: {position: [0.12, 0, 0]}}
  - {name: away, after: 1.5, pose: {position: [0.13, 0, 0.05], rpy: [3.141592653589793, 0, 0]}}
"""
DOWN = [pi, 0, 0]
TASK = kw.Task(
    robot="ur5",
    tool=Tool(
        offset=Placement(position=[0, 0, 0.12]),
        holds={
            "nozzle": HeldObject(
                taken_at="above",
                released_at="away",
                cylinder=SolidOfRevolution(radius=0.01, length=0.03),
            )
        },
    ),
    frames={"part": Frame(parent="base", position=[0.4, -0.1, 0.06])},
    frame="part",
    scene=Surroundings(
        objects={
            "floor": SceneObject(
                half_space=HalfSpace(normal=[0, 0, 1]), position=np.array([0, 0, -0.2])
            )
        }
    ),
    collisions=Collisions(itself=False),
    start="home",
    end_acceleration="zero",
    waypoints=[
        PoseWaypoint(
            name="above",
            time=2,
            pose=Pose(position=(0, 0, 0.05), rpy=DOWN),
            velocity=Velocity(angular=[0, 0, 0.1], axes="base"),
        ),
        PoseWaypoint(name="on", after=1, pose=Pose(position=[0, 0, 0], rpy=DOWN), wait=0.2),
        PathWaypoint(name="end", along="line", speed=0.04, pose=Placement(position=[0.12, 0, 0])),
        PoseWaypoint(name="away", after=1.5, pose=Pose(position=[0.13, 0, 0.05], rpy=DOWN)),
    ],
)
SWING = kw.Task(
    units=TaskUnits(angle="deg"),
    limits=Limits(velocity=90, acceleration=180),
    waypoints=[
        JointWaypoint(joints={"a": 0}),
        JointWaypoint(joints={"a": 40}, after="fastest", velocity="free"),
        JointWaypoint(joints={"a": 90}, after=Fastest(fastest=True, at_least=1.5)),
    ],
)


def motion(plan: kw.Plan) -> tuple[list[float], list[float]]:
    polynomial = plan.trajectory.polynomial
    return polynomial.x.tolist(), polynomial.c.ravel().tolist()


def test_a_task_in_python_and_its_file_give_one_motion(tmp_path: Path) -> None:
    file = written(tmp_path / "task.yaml", FILE)
    plan = kw.plan(TASK)
    assert plan.report.ok
    assert motion(plan) == motion(kw.plan(file))
    assert kw.Task.load(file) == TASK.replace(name="task")


@pytest.mark.parametrize("task", [TASK, SWING])
def test_saved_task_is_loaded_unchanged(task: kw.Task, tmp_path: Path) -> None:
    file = task.save(tmp_path / "folder" / "task.yaml")
    assert kw.Task.load(file) == task.replace(name="task")
    assert motion(kw.plan(file)) == motion(kw.plan(task))


@pytest.mark.parametrize("name", SCENARIO_FILES)
def test_shipped_scenarios_survive_being_saved(name: str, tmp_path: Path) -> None:
    task = kw.Task.load(name)
    saved, shipped = kw.load_scenario(task.save(tmp_path / f"{name}.yaml")), kw.load_scenario(name)
    assert saved.name == task.name == name
    for one, other in zip(saved.waypoints, shipped.waypoints, strict=True):
        assert (one.name, one.time) == (other.name, other.time)
    np.testing.assert_array_equal(kw.load_scenario(task).times, shipped.times)


def test_free_time_is_nan() -> None:
    np.testing.assert_array_equal(kw.load_scenario(SWING).times, [0.0, np.nan, np.nan])
    end = TASK.waypoints[2].replace(speed="fastest")
    task = TASK.replace(waypoints=[*TASK.waypoints[:2], end, TASK.waypoints[3]])
    expected = [0.0, 2.0, 3.0, 3.2, np.nan, np.nan]  # the wait stands twice
    np.testing.assert_array_equal(kw.load_scenario(task).times, expected)


@pytest.mark.parametrize("at", [("start", "a"), ("near", "a"), ("waypoints", 0, "near", "a")])
def test_configurations_have_the_units_of_their_joints(at: Location) -> None:
    given = {"a": 1}
    data = {"start": given, "near": given, "waypoints": [{"pose": {}, "near": given}]}
    assert unit_at(data, at, {"a": "m"}) == "m"


def test_defaults_of_zero_can_be_given() -> None:
    way = {"clear": True, "room": 0}
    ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 1, "way": way}]
    task = kw.Task.load({"pull_to_middle": 0, "waypoints": ends})
    assert (task.pull_to_middle, task.waypoints[1].way.extra_clearance) == (0, 0)


def test_no_key_is_forgotten_where_a_motion_is_executed_or_has_no_robot() -> None:
    """Each key either defines the motion or is kept; it either needs a robot or does not."""
    defining = "start near branch prefer pull_to_middle planner knots times ways duration objective"
    defining += " chosen end_acceleration planner_options path waypoints"
    assert marked(kw.Task, "defines_motion") == set(defining.split())
    any_joints = "name description units robot joint_units frames frame outputs start planner knots"
    any_joints += " times duration objective chosen end_acceleration planner_options limits"
    any_joints += " tolerances continuity path rate waypoints"
    assert kw.Task.model_fields.keys() - marked(kw.Task, "needs_robot") == set(any_joints.split())


def test_no_key_of_waypoints_is_forgotten_where_a_motion_is_executed_or_replaced() -> None:
    """Each key belongs to the pose, defines the motion, or is kept."""
    first = {"joints": {"a": 0}, "wait": 1, "do": [{"lamp": "on"}]}
    task = {"waypoints": [first, {"joints": {"a": 1}, "after": 2}]}
    motion = kw.plan(task)
    posed = "frame orientation_in pose free near speed along orientation blend weave"
    others = {"velocity", *f"{posed} after way stop".split()}  # a wait excludes a velocity
    kinds = (PoseWaypoint, PathWaypoint, JointWaypoint)
    for changed in (motion.scaled({0: 0.5}), motion.replan(0.0, task)):
        kept = changed.scenario.task.waypoints[0].model_fields_set
        assert {key for kind in kinds for key in kind.model_fields} - kept == others


def test_lists_of_task_are_immutable() -> None:
    task = TASK.replace(knots=np.array([0.0, 2.0, 3.0]), gravity=[0.0, 0.0, -9.81])
    assert task.knots == (0.0, 2.0, 3.0)
    assert task.waypoints[0].pose.rpy == (pi, 0.0, 0.0)
    assert task.to_dict()["gravity"] == [0.0, 0.0, -9.81]


def test_a_pose_may_be_pinocchio_s() -> None:
    pose = pin.SE3(pin.rpy.rpyToMatrix(pi, 0, 0), np.array([0.4, 0.1, 0.3]))
    task = kw.Task(robot="ur5", start="home", waypoints=[PoseWaypoint(after=2, pose=pose)])
    np.testing.assert_allclose(
        kw.load_scenario(task).waypoints[-1].pose.homogeneous, pose.homogeneous, atol=1e-15
    )


def test_files_are_found_wherever_a_task_is_saved(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "bead.csv").write_text("x,y,z\n0,0,0\n0.1,0,0\n", encoding="utf-8")
    line = PathWaypoint(
        along=AlongPoints(points="bead.csv"), speed=0.04, pose=Placement(position=[0.1, 0, 0])
    )
    begin = PoseWaypoint(name="begin", after=2, pose=Pose(position=[0, 0, 0], rpy=DOWN))
    task = TASK.replace(tool=None, waypoints=[begin, line])
    first = task.save(tmp_path / "one" / "task.yaml")
    second = kw.Task.load(first).save(tmp_path / "two" / "task.yaml")
    for file in (first, second):
        (path,) = kw.load_scenario(file).paths
        assert path.timed_path.tool_path.length == pytest.approx(0.1)


def test_a_wrong_part_is_refused_where_it_is_made() -> None:
    with pytest.raises(DocumentError) as caught:
        Pose(position=[0, 0], rpyy=DOWN)
    words = str(caught.value)
    assert "Pose.position" in words
    assert "Pose.rpyy: unknown key; did you mean 'rpy'?" in words
    with pytest.raises(DocumentError, match=r"Task\.waypoints: is missing"):
        kw.Task(robot="ur5")
    with pytest.raises(DocumentError) as caught:
        kw.load_robot({"urdf": "arm.urdf", "tool_frame": (1,), "base_frame": 3})
    assert [problem.field for problem in caught.value.problems] == ["base_frame", "tool_frame"]


@pytest.mark.parametrize(
    ("part", "unnamed", "values", "words"),
    [
        (PathWaypoint, (), {"along": Arc(through=[0, 0, 1])}, "along: Arc.*AlongArc, AlongPoints"),
        (PoseWaypoint, (), {"pose": Fastest(fastest=True)}, "pose: Fastest.*; accepted: Pose$"),
        (kw.Task, (), {"waypoints": JointWaypoint(joints="home")}, "waypoints: .*must be a list"),
        (kw.Task, (), {"waypoints": StringIO("home")}, "waypoints: '<.*StringIO.*must be a list"),
        (Velocity, ([0, 0, 1],), {}, r": \[0, 0, 1\]: is without a name; accepted: linear=…"),
    ],
)
def test_what_a_part_accepts_is_named(
    part: type[TaskPart], unnamed: tuple[Any, ...], values: dict[str, Any], words: str
) -> None:
    with pytest.raises(DocumentError, match=f"{part.__name__}.?{words}"):
        part(*unnamed, **values)


def test_fields_are_the_signature_before_and_after_the_first_use() -> None:
    class Unused(Collisions):
        later: float | None = None

    for _ in range(2):
        signature = inspect.signature(Unused)
        assert str(signature).startswith("(*, itself: 'Flag' = True, ")
        assert [*signature.parameters] == [*Unused.model_fields]
        Unused(later=1.0)
    assert inspect.signature(Action).bind(gripper="open", after=1).arguments["after"] == 1


def test_names_for_python_are_no_keys_of_files() -> None:
    frames = {"part": {"parent": "base", "position": [0, 0, 0]}}
    with pytest.raises(DocumentError, match=r"frames\.part\.parent: unknown key"):
        kw.load_scenario({**TASK.to_dict(), "frames": frames})


def test_null_is_the_same_as_a_value_left_out() -> None:
    branch = {"shoulder": "left", "elbow": None}
    task = kw.Task.load("ur5_valve")
    plans = [kw.plan({**task.to_dict(), "branch": b}) for b in (branch, {"shoulder": "left"})]
    assert [plan.report.ok for plan in plans] == [True, True]
    with_null, without = (plan.trajectory.polynomial.c for plan in plans)
    np.testing.assert_array_equal(with_null, without)
