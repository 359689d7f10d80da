"""Collisions and clearances against dense distances, and their messages."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh

import knotwork as kw
import seams
from drawn import scene, thing, vertices
from judge.bodies import Surroundings
from judge.motion import Motion
from judge.task import Task
from knotwork.errors import FollowingError, InputError
from knotwork.verification import Finding
from plans import arm, passing_plan, planned
from sweeps import mostly_exhaustive

ARMS = ("ur3", "ur5", "ur10", "panda", "xarm7", "z1")
DOWN = [180, 0, 0]


def pairs(report: kw.Report) -> dict[str, Finding]:
    """What was found of each pair, by its name."""
    return {finding.name: finding for finding in report.select(quantity="clearance")}


# The proof


def random_task(
    name: str, rng: np.random.Generator, boxes: int, ring: Path | None = None
) -> dict[str, Any]:
    """A motion through random configurations, among random boxes, and a mesh as it is."""
    robot = kw.load_robot(name)
    low = np.maximum(robot.limits.lower, -math.pi)
    high = np.minimum(robot.limits.upper, math.pi)
    q = [robot.configurations["home"], *rng.uniform(low, high, (3, robot.dof))]
    reach = float(np.linalg.norm(robot.forward(q[0]).translation)) + 0.2

    def placed(shape: dict[str, Any]) -> dict[str, Any]:
        position, turn = reach * rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3)
        return shape | {"position": position.tolist(), "rotation_vector": turn.tolist()}

    objects = {
        f"box {i}": placed({"box": rng.uniform(0.02, 0.3, 3).tolist()}) for i in range(boxes)
    }
    if ring is not None:
        objects["ring"] = placed({"mesh": str(ring), "exact": True})
    times = np.cumsum(rng.uniform(0.5, 3.0, len(q)))
    return {
        "robot": name,
        "scene": {"objects": objects},
        "waypoints": [
            {"joints": dict(zip(robot.joint_names, p.tolist(), strict=True)), "time": t, **stop}
            for p, t, stop in zip(
                q, times.tolist(), [{}, {"stop": True}, {"stop": True}, {}], strict=True
            )
        ],
    }


def compare_with_truth(task: dict[str, Any], samples: int) -> int:
    """Hold the proved clearances of a motion to dense distances; says how many were measured."""
    plan = kw.plan(task)
    curve = plan.trajectory.polynomial
    motion = Motion(plan.trajectory.joint_names, curve.x, curve.c)
    around = Surroundings(Task(task, Path()), motion)
    found = {frozenset(name.split(", ")): one for name, one in pairs(plan.report).items()}

    def distances(t: float) -> dict[frozenset[str], float]:
        every = around.distances(motion(t))
        return {
            frozenset((one.name, other.name)): min(every[indices])
            for one, other, _, indices in around.pairs
        }

    times = np.linspace(motion.x[0], motion.x[-1], samples)
    dense = [distances(t) for t in times]
    assert found.keys() == dense[0].keys()
    for names, one in found.items():
        assert one.value is not None
        assert one.time is not None
        assert one.proof == "bounded"
        at = distances(one.time)[names]
        least = min(row[names] for row in dense)
        if at > 0:
            assert one.value == pytest.approx(at, abs=2e-6), names
            assert least >= one.value - one.proof_gap - 2e-6, names
            assert one.ok, names
        else:
            assert one.value <= 0, names
            assert not one.ok, names
        assert one.ok or least < 1e-3 or samples < 1000, names
        assert not one.ok or least > 0, names
    return samples * len(found)


@pytest.mark.parametrize("arm", ["ur5", "panda"])
def test_sampled_distances_stay_above_proved_clearance(arm: str) -> None:
    task = random_task(arm, np.random.default_rng(0), boxes=3)
    assert compare_with_truth(task, 120) > 1000


@pytest.mark.exhaustive
def test_million_distances_stay_above_proved_clearances(tmp_path: Path) -> None:
    ring = tmp_path / "ring.stl"
    trimesh.creation.torus(0.3, 0.04, major_sections=16, minor_sections=8).export(ring)
    measured = 0
    rng = np.random.default_rng(15)
    while measured < 1_000_000:
        for name in ARMS:
            task = random_task(name, rng, boxes=3, ring=ring)
            try:
                measured += compare_with_truth(task, 1000)
            except InputError:
                continue  # a box stands where the arm starts


def swing(objects: dict[str, Any], margin: float = 0.0) -> kw.Plan:
    """A planar arm swings a thin blade at its tip by 150 degrees; all else may touch."""
    allow = {"allow": ["base", "upper_arm", "forearm"]}
    return kw.plan(
        {
            "robot": "planar2",
            "tool": {"shape": {"box": [0.1, 1e-3, 0.02], "position": [0.05, 0, 0]}},
            "scene": {
                "margin": margin,
                "objects": {name: one | allow for name, one in objects.items()},
            },
            "limits": {"velocity": 50.0, "acceleration": 500.0, "jerk": 5000.0, "effort": 1e6},
            "waypoints": [
                {"joints": {"shoulder": 0, "elbow": 0}},
                {"joints": {"shoulder": 2.6, "elbow": 0}, "after": 1},
            ],
            "collisions": {"self": False, "resolution": 1e-4},
        }
    )


def rod(angle: float, radius: float) -> dict[str, Any]:
    """A thin rod that stands upright so far from the shoulder [m]."""
    place = [radius * math.cos(angle), radius * math.sin(angle), 0.0]
    return {"cylinder": {"radius": 2e-4, "length": 0.2}, "position": place}


def test_finds_thin_rods_that_1_khz_samples_miss() -> None:
    angles = np.random.default_rng(1).uniform(0.5, 2.1, 12)
    objects = {f"rod {i}": rod(angle, 0.93) for i, angle in enumerate(angles)}
    plan = swing(objects)
    found = pairs(plan.report)
    assert len(found) == len(objects)
    assert not any(one.ok for one in found.values())
    blade, thin = coal.Box(0.1, 1e-3, 0.02), coal.Cylinder(2e-4, 0.2)
    seen = 0
    for angle in angles:
        there = coal.Transform3s(np.eye(3), np.array(rod(angle, 0.93)["position"]))
        for t in np.arange(0, 1, 1e-3):
            turn = pin.rpy.rpyToMatrix(0, 0, float(plan.trajectory(t)[0]))
            here = coal.Transform3s(turn, turn @ np.array([0.95, 0, 0]))
            result = coal.CollisionResult()
            seen += coal.collide(blade, here, thin, there, coal.CollisionRequest(), result) > 0
    assert seen < len(angles) / 2
    for i, angle in enumerate(angles):
        one = found[f"tool, rod {i}"]
        assert one.interval[0] <= one.time <= one.interval[1]
        assert one.interval[1] - one.interval[0] < 2e-3
        assert plan.trajectory(one.time)[0] == pytest.approx(angle, abs=2e-3)


def test_clearance_within_distance_error_of_margin_is_unproved_and_fails() -> None:
    radius = 1.0 + 5e-4 + 2e-4  # the rod's, with the margin
    plan = swing({"rod": rod(1.3, radius + 5e-7)}, margin=5e-4)
    (finding,) = plan.report.select(quantity="clearance")
    assert not finding.ok
    assert "it is not proved to keep clear from" in " ".join(str(plan.report).split())
    assert "not proved" in plan.report.to_dict()["failures"][0]
    shown = scene(plan.view())
    (miss,) = [label["text"] for label in shown["labels"] if label["kind"] == "miss"]
    assert "unproved: tool comes within" in miss
    assert len(shown["strip"]["exceeded"]) == 1
    assert finding.interval is not None
    farther = swing({"rod": rod(1.3, radius + 2e-5)}, margin=5e-4)
    (finding,) = farther.report.select(quantity="clearance")
    assert finding.ok
    assert finding.value == pytest.approx(5e-4 + 2e-5, abs=2e-6)


# Messages


def reach(name: str, y: float, z: float, after: float = 3, **more: Any) -> dict[str, Any]:
    """A waypoint over x = 500 mm with the tool downwards."""
    return {"name": name, "after": after, "pose": {"position": [500, y, z], "rpy": DOWN}, **more}


WALL = {"box": [300, 20, 250], "position": [500, 0, 105]}
FLOOR = {"half_space": {"normal": [0, 0, 1]}, "position": [0, 0, -20]}
OFFSET = {"position": [0, 0, 150], "rpy": [0, 0, 0]}
ROD = {"cylinder": {"radius": 20, "length": 150}, "position": [0, 0, 75]}
REACH_OVER = seams.task(
    reach("here", -200, 150, stop=True),
    reach("there", 200, 150),
    tool={"offset": OFFSET, "shape": ROD},
    scene={"margin": 5, "objects": {"floor": FLOOR, "wall": WALL}},
)


def test_reports_depth_and_place_of_collision() -> None:
    report = kw.plan(REACH_OVER).report
    finding = pairs(report)["tool, wall"]
    assert not finding.ok
    assert finding.value < 0
    assert len(finding.points) == 2
    assert finding.utilisation == math.inf  # 5 mm are required, and none are left
    for words in ("mm deep in wall at", "between 'here' and 'there'", "required 5 mm"):
        assert words in finding.message


def test_waypoints_below_floor_collide() -> None:
    down = seams.task(reach("low", 100, -500, after=4))
    assert kw.plan(down).report.ok
    report = kw.plan({**down, "scene": {"objects": {"floor": FLOOR}}}).report
    failed = {finding.name for finding in report.failures}
    assert "wrist_3_link, floor" in failed
    worst = pairs(report)["wrist_3_link, floor"]
    assert worst.value < -0.45
    assert worst.remedy == "move waypoint 'low', which itself collides"
    places = (("low", 100, -500), ("over", 200, 500), ("also low", 300, -500))
    rows = [reach(*place, after=4, stop=True) for place in places]
    report = kw.plan(seams.task(*rows, scene={"objects": {"floor": FLOOR}})).report
    worst = pairs(report)["wrist_3_link, floor"]
    assert worst.remedy == "move waypoint 'low', waypoint 'also low', which themselves collide"


# Tool, held objects, pairs that are not checked


VIAL: dict[str, Any] = {
    **REACH_OVER,
    "tool": {
        "offset": OFFSET,
        "shape": {"box": [60, 20, 150], "position": [0, 0, 75]},
        "holds": {
            "vial": {
                "from": "here",
                "to": "there",
                "allow": ["rack"],
                "cylinder": {"radius": 8, "length": 60},
                "position": [0, 0, 25],
            }
        },
    },
    "scene": {"objects": {"rack": {"box": [60, 60, 90], "position": [500, -200, 50]}}},
}


def test_tool_collides_with_released_object() -> None:
    """It may touch the vial until the waypoint after it left it; it comes back into it."""
    waypoints = [
        *({**waypoint, "stop": True} for waypoint in VIAL["waypoints"]),
        reach("up", 200, 400, after=2, stop=True),
        reach("low", 200, 130),
    ]
    assert kw.plan({**VIAL, "waypoints": waypoints[:3]}).report.ok
    (hit,) = kw.plan({**VIAL, "waypoints": waypoints}).report.failures
    assert hit.name == "tool, vial"
    assert hit.shown_time == pytest.approx(11, abs=0.5)


def test_object_appearing_at_last_waypoint_is_checked() -> None:
    """The tool once stood in it, and the check reported nothing."""
    at_the_end = {"box": [60, 60, 60], "position": [500, 200, 150], "appears": "there"}
    scene = {"objects": {**VIAL["scene"]["objects"], "late": at_the_end}}
    plan = kw.plan({**VIAL, "scene": scene})
    failed = {finding.name: finding for finding in plan.report.failures}
    assert "tool, late" in failed
    assert all(one.shown_time == pytest.approx(plan.trajectory.end_time) for one in failed.values())
    late = {**at_the_end, "position": [500, 200, -400]}
    assert kw.plan({**VIAL, "scene": {"objects": {**scene["objects"], "late": late}}}).report.ok


def test_allowed_and_ignored_pairs_are_not_checked() -> None:
    free = {**WALL, "allow": ["tool", "wrist_3_link", "wrist_2_link", "ee_link", "tool0"]}
    allowed = kw.plan({**REACH_OVER, "scene": {"objects": {"wall": free}}}).report
    assert "tool, wall" not in pairs(allowed)
    messages = [one.message for one in allowed.select(quantity="pairs_not_checked")]
    listed = "wrist_2_link and wall; wrist_3_link and wall; ee_link and wall; tool and wall"
    assert f"not checked, since the scenario allows it: {listed}" in messages
    ignored = kw.plan({**REACH_OVER, "collisions": {"ignore": [["tool", "wall"]]}}).report
    assert "tool, wall" not in pairs(ignored)
    messages = [one.message for one in ignored.select(quantity="pairs_not_checked")]
    assert "not checked, since the scenario ignores it: tool and wall" in messages
    assert any("since a joint joins them: base_link and" in one for one in messages)
    assert not any("move as one" in one for one in messages)
    visual = {**REACH_OVER, "scene": {"objects": {"wall": {**WALL, "visual": True}}}}
    assert not any("wall" in name for name in pairs(kw.plan(visual).report))
    alone = {**REACH_OVER, "collisions": {"self": False}, "scene": {"objects": {}}}
    assert all("tool" in name for name in pairs(kw.plan(alone).report))


@pytest.mark.parametrize(
    "name", mostly_exhaustive(kw.robot_names(), "planar2", "panda", "ur5_turntable")
)
def test_shipped_robots_are_clear_at_home(name: str) -> None:
    home = {"joints": "home"}
    still = kw.plan({"robot": name, "waypoints": [home, {**home, "after": 1}]})
    assert not [finding for finding in still.report.failures if finding.group == "Collisions"]
    if name != "planar2":
        assert len(pairs(still.report)) > 8


# The choice of solutions


def test_skips_sequence_whose_motion_collides() -> None:
    """The best sequence of the valve has its wrist in its forearm; with it, the check fails."""
    plan = planned("ur5_valve")
    assert plan.report.ok
    (tried,) = plan.report.select(quantity="sequences_tried")
    assert "collides; of 2 sequences tried this is the first that is" in tried.message
    task = plan.scenario.task.to_dict()
    task.pop("scene")
    alone = passing_plan({**task, "collisions": {"self": False}})
    report = kw.check(alone.trajectory, plan.scenario)
    assert {"wrist_3_link, forearm_link"} <= {finding.name for finding in report.failures}


def test_skips_solutions_that_collide_at_waypoint() -> None:
    """A ball is where the wrist is in the solution of least travel."""
    place = {"position": [0.45, 0.0, 0.4], "rotation_vector": [math.pi, 0, 0]}
    waypoints = [{"name": "there", "after": 4, "pose": place}]
    task = {"robot": "ur5", "start": "home", "waypoints": waypoints}
    free = kw.plan(task)
    q = free.joint_waypoints.position[-1]
    robot = arm(free)
    pin.forwardKinematics(robot.model, robot.data, q)
    wrist = robot.data.oMi[4].translation  # from the root of the URDF, which is the base
    ball = {"sphere": 0.015, "position": wrist.tolist()}
    blocked = passing_plan({**task, "scene": {"objects": {"ball": ball}}})
    assert np.abs(blocked.joint_waypoints.position[-1] - q).max() > 0.1


def test_names_contact_on_path_before_later_joint_limit() -> None:
    here = reach("here", -200, 150, stop=True)
    there = {"name": "there", "along": "line", "speed": 50, "pose": {"position": [500, 200, 150]}}
    scene = {"margin": 5, "objects": {"wall": WALL}}
    with pytest.raises(FollowingError) as error:
        kw.plan({**REACH_OVER, "scene": scene, "waypoints": [here, there]})
    assert error.value.cause == "collision"
    assert "the tool is too near to wall" in str(error.value)
    # the tool has a radius of 20 mm, the wall is 20 mm thick, and 5 mm are kept
    assert error.value.arc_length == pytest.approx(0.165, abs=2e-4)


def test_reports_every_contact_of_pair() -> None:
    plan = kw.plan(REACH_OVER)
    contact = pairs(plan.report)["tool, wall"]
    # by distances at 3001 times
    expected = [(1.018, 1.324), (4.512, 4.824)]
    np.testing.assert_allclose(contact.intervals, expected, rtol=0, atol=5e-3)
    assert contact.interval in contact.intervals
    start, end = contact.interval or (0.0, 0.0)
    assert f"too near from {start:.3f} s to {end:.3f} s and 1 more time;" in contact.message
    drawn = scene(plan.view())
    np.testing.assert_allclose(drawn["strip"]["exceeded"], contact.intervals, atol=0.02)
    red = vertices(thing(drawn, "limits exceeded"))
    assert len(red)
    (label,) = [one["text"] for one in drawn["labels"] if one["kind"] == "miss"]
    assert f"at {contact.time:.3f} s" in label


# Meshes


def write_bowl(path: Path) -> None:
    """A box of 400 x 400 x 200 mm with a pit of 300 x 300 x 150 mm from above."""
    # no corner is that of two parts, so that each is closed
    parts = [trimesh.creation.box([380, 380, 50]).apply_translation([0, 0, 25])]
    for side in (-175, 175):
        parts.append(trimesh.creation.box([50, 400, 200]).apply_translation([side, 0, 100]))
        parts.append(trimesh.creation.box([398, 50, 200]).apply_translation([0, side, 100]))
    trimesh.util.concatenate(parts).export(path)


def bowl_task(path: Path, **more: Any) -> dict[str, Any]:
    """The tool goes down into the bowl and up again."""
    return {
        **REACH_OVER,
        "scene": {"objects": {"bowl": {"mesh": str(path), "position": [500, 0, 0], **more}}},
        "waypoints": [reach("above", 0, 260, stop=True), reach("in", 0, 90, after=2)],
    }


def test_hull_fills_bowl_and_exact_mesh_does_not(tmp_path: Path) -> None:
    write_bowl(tmp_path / "bowl.stl")
    hull = pairs(kw.plan(bowl_task(tmp_path / "bowl.stl")).report)["tool, bowl"]
    assert not hull.ok
    exact = pairs(kw.plan(bowl_task(tmp_path / "bowl.stl", exact=True)).report)["tool, bowl"]
    assert exact.ok
    assert exact.value == pytest.approx(0.04, abs=1e-3)  # above the floor of the pit
    deeper = bowl_task(tmp_path / "bowl.stl", exact=True)
    deeper["waypoints"][1]["pose"] = {"position": [500, 0, 45], "rpy": DOWN}
    assert not pairs(kw.plan(deeper).report)["tool, bowl"].ok


def shell_of(boxes: list[tuple[float, float, bool]], path: Path) -> None:
    """Write cubes by edge, height of the middle and whether their triangles face inwards."""
    parts = []
    for edge, height, inwards in boxes:
        part = trimesh.creation.box([edge] * 3)
        part.apply_translation([0, 0, height])
        if inwards:
            part.invert()
        parts.append(part)
    trimesh.util.concatenate(parts).export(path)


@pytest.mark.parametrize(
    ("boxes", "clear"),
    [
        ([(4.0, 0.0, False)], False),
        ([(4.0, 0.0, True)], False),
        ([(4.0, 0.0, False), (3.5, 0.0, True)], True),
        ([(4.0, 0.0, True), (3.5, 0.0, False)], True),
        ([(4.0, 0.0, False), (4.0, 0.1, True)], False),
    ],
)
def test_orientation_of_triangles_makes_no_difference(
    boxes: list[tuple[float, float, bool]], clear: bool, tmp_path: Path
) -> None:
    shell_of(boxes, tmp_path / "room.stl")
    report = swing({"room": {"mesh": str(tmp_path / "room.stl"), "exact": True}}).report
    findings = report.select(quantity="clearance")
    assert findings
    assert all(one.ok == clear for one in findings)


@pytest.mark.parametrize("order", [1, -1])
def test_finds_every_part_of_mesh_inside_another(order: int, tmp_path: Path) -> None:
    shell_of([(20, 60, False), (20, 400, False)][::order], tmp_path / "tool.stl")
    shell_of([(200, 0, True)], tmp_path / "shell.stl")
    robot = kw.load_robot("ur5")
    home = robot.configurations["home"]
    place = robot.forward(home)
    joints = dict(zip(robot.joint_names, np.degrees(home).tolist(), strict=True))
    shell = {
        "mesh": str(tmp_path / "shell.stl"),
        "exact": True,
        "position": (1000 * place.act(np.array([0, 0, 0.4]))).tolist(),
        "rotation_vector": np.degrees(pin.log3(place.rotation)).tolist(),
    }
    last = robot.joint_names[-1]
    turned = seams.task(
        {"joints": {**joints, last: joints[last] + 30}, "after": 3},
        tool={"frame": "tool0", "shape": {"mesh": str(tmp_path / "tool.stl"), "exact": True}},
        scene={"objects": {"shell": shell}},
    )
    assert not pairs(kw.plan(turned).report)["tool, shell"].ok


@pytest.mark.parametrize(
    "scene", [{}, {"objects": {"ball": {"sphere": 0.1, "position": [3, 0, 0]}}}]
)
def test_names_links_without_collision_shapes(scene: dict[str, Any]) -> None:
    robot = kw.load_robot("z1")
    home = dict(zip(robot.joint_names, robot.configurations["home"].tolist(), strict=True))
    first = robot.joint_names[0]
    ends = [{"joints": home}, {"joints": home | {first: home[first] + 0.1}, "after": 2}]
    report = kw.plan({"robot": "z1", "scene": scene, "waypoints": ends}).report
    (finding,) = report.select(quantity="collision_shapes")
    assert finding.verdict == ("warning" if scene else "information")
    assert finding.message.startswith("links link01 and link05 have no collision shapes")


def test_distance_is_that_of_nearest_points() -> None:
    report = planned("panda_pick_place").report
    for found in pairs(report).values():
        gap = np.linalg.norm(np.subtract(*found.points))
        assert gap == pytest.approx(abs(found.value or 0), abs=1e-6), found.name
