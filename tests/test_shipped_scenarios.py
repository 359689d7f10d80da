"""Every shipped scenario, planned by name and by path, and what its description promises."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import knotwork as kw
from command_line import Command
from judge.task import Task
from judged import judged_folder
from knotwork.errors import UnknownNameError
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_space import joint_space
from knotwork.waypoints import CartesianWaypoint, JointWaypoints
from plans import planned
from shipped import LONG, SCENARIO_FILES
from sweeps import mostly_exhaustive

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[1]
PATHS = sorted((ROOT / "scenarios").glob("*.yaml"))
SLOW = LONG | {"panda_bookshelf", "ur5_dome", "ur5_machine_door"}
QUICK = [path for path in PATHS if path.stem not in SLOW]

WARNINGS = {
    "ur5_turntable_rim": ["efforts are not judged, as table, which carries the poses, moves"],
}
"""Of scenarios that are warned of, on purpose."""


def test_the_folder_holds_the_scenarios_that_are_shipped() -> None:
    with pytest.raises(UnknownNameError) as unknown:
        kw.load_scenario("none")
    assert unknown.value.available == tuple(path.stem for path in PATHS)
    assert len(PATHS) == 26
    robots = {str(kw.load_scenario(path).task.robot) for path in PATHS}
    assert {"ur5", "panda", "kinova", "ur10", "xarm7", "planar2", "None"} <= robots


@pytest.mark.parametrize("path", mostly_exhaustive(PATHS, *QUICK), ids=lambda path: path.stem)
def test_it_passes_the_judge_too_and_reports_the_branches_it_takes(
    path: Path, knotwork: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No acceleration is a spike, though in the fastest ones it changes sign in milliseconds."""
    monkeypatch.setenv("COLUMNS", "300")  # so that no cell of a table is wrapped
    ran = knotwork("plan", path.stem, "--full", "--out", tmp_path)
    assert (ran.code, ran.err) == (0, "")
    assert f"PASSED {path.stem}" in ran.out
    saved = json.loads((tmp_path / "report.json").read_text())
    assert saved["ok"]
    assert not [one for one in saved["findings"] if one["quantity"].endswith("_spike")]
    assert judged_folder(tmp_path, path) == []
    assert [one.partition(" for ")[0] for one in saved["warnings"]] == WARNINGS.get(path.stem, [])
    # where times are free, the numbers in their place say what the motion has to do when
    numbers = tmp_path / "scenario.yaml"
    free = kw.load_scenario(path).free is not None
    assert numbers.exists() == free
    assert knotwork("check", tmp_path, "--scenario", numbers if free else path.stem).code == 0

    posed = [w.name for w in kw.load_scenario(path).waypoints if isinstance(w, CartesianWaypoint)]
    assert ("Solutions chosen" in ran.out) == ("solutions" in saved) == bool(posed)
    solutions = saved.get("solutions", {"infeasibilities": [], "choices": []})
    assert solutions["infeasibilities"] == []
    assert [choice["waypoint"] for choice in solutions["choices"]] == posed
    for choice in solutions["choices"]:
        assert choice["branch"] in " ".join(ran.out.split())
        assert choice["solutions"] >= choice["branches"] >= 1


def test_a_scenario_is_the_same_by_name_and_by_path(knotwork: Command) -> None:
    path = SCENARIO_FILES["ur3_lid"]
    by_name, by_path = (knotwork("plan", one, "--json") for one in ("ur3_lid", path))
    assert (by_name.code, by_name.err) == (0, "")
    reports = [json.loads(one.out)["plans"][0]["report"] for one in (by_name, by_path)]
    assert reports[0] == reports[1]
    assert "solutions" in reports[0]


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_it_is_described_and_its_waypoints_are_named(path: Path) -> None:
    scenario = kw.load_scenario(path)
    assert scenario.name == path.stem
    assert len(scenario.task.description.split()) >= 4
    assert not any(waypoint.name.startswith("waypoint ") for waypoint in scenario.waypoints)
    assert path.read_text().startswith("#")


class Asked(NamedTuple):
    """What the description of a scenario with a path says of it, in units of its own frame [mm]."""

    first: str
    last: str
    frame: tuple[list[float], list[float]]
    speed: float
    off: Callable[[Array], Array]
    turned: Callable[[Array], Array]
    length: float
    ease: float = 0.0  # how far the tool turns ahead of the path where its turning begins [rad]
    seam: Callable[[Array], Array] = lambda x: x  # places without what a weave adds


def off_line(x: Array) -> Array:
    return np.linalg.norm(x[:, 1:], axis=1)


def off_circle(radius: float) -> Callable[[Array], Array]:
    return lambda x: np.hypot(np.linalg.norm(x[:, :2], axis=1) - radius, x[:, 2])


def off_seam(x: Array) -> Array:
    """Off two sides at right angles and a corner of 25 mm between them."""
    spoke = np.stack((np.maximum(x[:, 0] - 175, 0), np.minimum(x[:, 1] - 25, 0)), axis=1)
    return np.hypot(np.linalg.norm(spoke, axis=1) - 25, x[:, 2])


def off_strokes(x: Array) -> Array:
    """Off three strokes along y, 100 mm apart, and the half circles that join them."""
    y = np.clip(x[:, 1], 0, 600)
    strokes = [np.hypot(x[:, 0] - at, x[:, 1] - y) for at in (0, 100, 200)]
    turns = [
        np.where(
            side * (x[:, 1] - end) >= 0,
            np.abs(np.hypot(x[:, 0] - at, x[:, 1] - end) - 50),
            np.inf,
        )
        for at, end, side in ((50, 600, 1), (150, 0, -1))
    ]
    return np.hypot(np.min(strokes + turns, axis=0), x[:, 2] - 200)


def corner_angle(x: Array) -> Array:
    """How far the seam has turned [rad]."""
    spoke = x[:, :2] - [175, 25]
    return np.clip(np.arctan2(spoke[:, 0], -spoke[:, 1]), 0, np.pi / 2)


ASKED = {
    "ur5_deburring": Asked(
        *("edge start", "edge end", ([450, -150, 200], [0, 0, 90]), 50, off_line),
        turned=lambda x: np.zeros(len(x)),
        length=300,
    ),
    "ur10_spray": Asked(
        *("stroke 1 in", "stroke 3 out", ([650, -300, 150], [0, -50, 0]), 300, off_strokes),
        turned=lambda x: np.zeros(len(x)),
        length=3 * 600 + 100 * np.pi,
    ),
    "kinova_dispense": Asked(
        *("bead start", "bead end", ([400, -100, 150], [0, 0, 0]), 20, off_circle(60)),
        turned=lambda x: np.unwrap(np.arctan2(x[:, 1], x[:, 0])),
        length=60 * np.radians(390),
    ),
    "ur10_weave": Asked(
        *("seam start, after the wait", "seam end", ([600, 150, 60], [0, 0, -90]), 6),
        off=lambda x: np.hypot(np.maximum(abs(x[:, 1]) - 2, 0), x[:, 2] - 3),
        turned=lambda x: np.zeros(len(x)),
        length=100,
        seam=lambda x: x * [1, 0, 1],
    ),
    "ur10_weld": Asked(
        *("seam start, after the wait", "seam end", ([600, 200, 50], [0, 0, -90]), 8, off_seam),
        turned=corner_angle,
        length=175 + 12.5 * np.pi + 100,
        ease=0.025 * np.pi / 2,
    ),
    "xarm7_bead": Asked(
        *("bead start, after the wait", "bead end", ([400, 50, 150], [0, -20, 0]), 30),
        off=off_circle(40),
        turned=lambda x: np.zeros(len(x)),
        length=80 * np.pi,
    ),
}


@pytest.mark.parametrize("name", ASKED)
def test_the_tool_keeps_to_the_path_that_the_description_promises(name: str) -> None:
    """Dense samples, against the geometry written down here and tolerances of the file."""
    scenario, plan, asked = kw.load_scenario(name), planned(name), ASKED[name]
    assert f"{asked.speed} mm/s" in scenario.task.description
    when = {waypoint.name: waypoint.time for waypoint in scenario.waypoints}
    t = np.linspace(when[asked.first], when[asked.last], 3001)
    poses = Task.read(SCENARIO_FILES[name]).arm.poses(plan.trajectory(t), t)
    position = 1e3 * np.array([pose.translation for pose in poses])
    place, angles = asked.frame
    turn = pin.rpy.rpyToMatrix(*np.radians(angles))
    x = (position - place) @ turn
    assert asked.off(x).max() <= 1e3 * scenario.si.tolerances.path

    def about_z(angle: float) -> Array:
        return np.asarray(pin.rpy.rpyToMatrix(0, 0, angle))

    first = turn.T @ poses[0].rotation
    allowed = scenario.si.tolerances.path_orientation + asked.ease + 1e-6
    for pose, angle in zip(poses[::10], asked.turned(x)[::10], strict=True):
        error = pin.log3((about_z(angle) @ first).T @ turn.T @ pose.rotation)
        assert np.linalg.norm(error) <= allowed

    way = np.linalg.norm(np.diff(asked.seam(x), axis=0), axis=1)
    assert way.sum() == pytest.approx(asked.length, rel=1e-3)
    (path,) = scenario.paths
    full = np.zeros(len(t) - 1, dtype=bool)
    for stretch in path.stretches:
        assert stretch.speed == pytest.approx(1e-3 * asked.speed)
        full |= (t[:-1] >= stretch.full_speed[0]) & (t[1:] <= stretch.full_speed[1])
    assert full.mean() > 0.9
    speed = way / np.diff(t)
    off = np.abs(speed[full] / asked.speed - 1).max()
    assert off <= scenario.si.tolerances.path_speed
    assert all(
        found.proof == "bounded"
        for found in plan.report.findings
        if found.quantity.startswith("path_")
    )


def nearest_by_nearest(scenario: Scenario) -> JointWaypoints:
    """Joint waypoints as one takes them without looking ahead: each nearest the one before."""
    space = joint_space(scenario)
    assert space.robot is not None
    q, positions, velocities = space.configurations["home"], [], []
    for waypoint, state in zip(scenario.waypoints, space.targets, strict=True):
        if state is not None:
            q, v = state.position, state.velocity
        else:
            assert isinstance(waypoint, CartesianWaypoint)
            q = kw.solve_pose_ik(space.robot, waypoint.pose, q).q
            v = kw.solve_velocity_ik(space.robot, q, waypoint.twist)
        positions.append(q)
        velocities.append(v)
    return JointWaypoints(
        space.joint_names, scenario.times, np.array(positions), np.array(velocities)
    )


@pytest.mark.parametrize("name", ["ur5_valve", "ur3_lid"])
def test_taking_the_nearest_solution_each_time_fails_where_the_plan_passes(name: str) -> None:
    scenario = kw.load_scenario(name)
    waypoints = nearest_by_nearest(scenario)
    options = kw.interpolation.PlannerOptions(end_acceleration="zero")
    trajectory = kw.interpolation.get_planner(scenario.si.planner)(waypoints, options)
    report = kw.check(trajectory, scenario)
    broken = {found.name for found in report.failures if found.quantity == "velocity"}
    assert len(broken) >= 3
    assert all(found.ok for found in report.select(subject="waypoint"))
    plan = planned(name)
    assert plan.report.ok
    assert plan.solution is not None
    assert not plan.solution.infeasibilities
    # The poses are the same, and so are the branches all the way: the arm does not change over.
    assert len({choice.branch for choice in plan.solution.choices}) == 1


def test_the_valve_is_taken_with_the_wrist_that_is_farther_away() -> None:
    naive = nearest_by_nearest(kw.load_scenario("ur5_valve")).position
    chosen = planned("ur5_valve").joint_waypoints.position
    assert np.sin(naive[1, 4]) == pytest.approx(-np.sin(chosen[1, 4]), abs=1e-9)
    limit = np.radians(200)
    assert np.abs(chosen[:, 5]).max() <= limit
    # From where the nearest solution takes the key it is out of reach to turn it all the way.
    assert naive[2, 5] + np.radians(240) > limit


def test_the_last_joint_is_unwound_by_a_whole_turn_before_the_lid() -> None:
    naive = nearest_by_nearest(kw.load_scenario("ur3_lid")).position
    plan = planned("ur3_lid")
    chosen = plan.joint_waypoints.position
    np.testing.assert_allclose(chosen[1], naive[1] - [0, 0, 0, 0, 0, 2 * np.pi], atol=1e-7)
    assert plan.solution is not None
    assert plan.solution.choices[0].turns == (("wrist_3_joint", -1),)
    np.testing.assert_allclose(chosen[-2, 5] - chosen[2, 5], np.radians(300), atol=1e-9)
