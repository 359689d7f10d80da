"""A part is fetched at a place beside a positioner and worked on; two robots at moved tables."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from drawn import placed
from moving.moving_truth import Bodies, OfArm, links, seen
from moving.test_held_on_belts import SIZE, check_box
from moving.test_moving_things import LEFT, check_pairs, middle_of_held, scene_of, times
from moving.test_placed_urdfs import HOME, STEP, TILT, Composed, folder, named, shapes, task
from plans import passing_plan
from sweeps import mostly_exhaustive
from texts import written

__all__ = ["folder"]
PICK, PLACE = 4.5, 10.0
OFFSET = pin.SE3(np.eye(3), np.array([0, 0, 0.036]))
BESIDE, ON_PART = [0.25, -0.45, 0.2], [0.0, 0.0, 0.25]


def pose(position: list[float], **more: Any) -> dict[str, Any]:
    given = {"position": [*position], "rpy": [np.pi, 0, 0]}
    return {"pose": given, "after": 1.5, "stop": True, **more}


def fetch(folder: Path, **more: Any) -> dict[str, Any]:
    """A box is taken in the cell, put on the plate, and a line is followed there."""
    over = [0.25, -0.45, 0.3]
    line = {"along": "line", "speed": 0.05, "stop": True, "after": None}
    box = {
        "from": "pick",
        "to": "place",
        "box": SIZE,
        "position": [0, 0, 0.036],
        "allow": ["plate"],
    }
    waypoints = [
        pose(over, frame="base", name="over", after=3),
        pose(BESIDE, frame="base", name="pick"),
        pose(over, frame="base", name="away"),
        pose(ON_PART, name="place", after=4.0),
        pose([0.0, -0.1, 0.35], name="off"),
        {**pose([0.1, -0.05, 0.35], name="end"), **line},
        pose(over, frame="base", name="back", after=4),
    ]
    waypoints = [{k: v for k, v in waypoint.items() if v is not None} for waypoint in waypoints]
    tool = {"offset": {"position": [0, 0, 0.1]}, "holds": {"box": box}}
    return task(folder, tool=tool, waypoints=waypoints, **more)


def tcp(both: Composed, q: dict[str, float]) -> pin.SE3:
    return both.tool(q) * pin.SE3(np.eye(3), np.array([0, 0, 0.1]))


def part(both: Composed, q: dict[str, float]) -> pin.SE3:
    return both.link(q, "plate") * STEP


def test_meets_each_pose_in_its_frame(folder: Path) -> None:
    plan = passing_plan(fetch(folder))
    both = Composed(folder)
    down = pin.rpy.rpyToMatrix(np.pi, 0, 0)
    for one, given in zip(plan.scenario.waypoints[1:], fetch(folder)["waypoints"], strict=True):
        q = named(plan, one.time)
        seen = tcp(both, q)
        if given.get("frame") != "base":
            seen = part(both, q).actInv(seen)
        else:
            assert (q[TILT], np.sin(q["turn"] / 2)) == pytest.approx((0.0, 0.0), abs=1e-9)
        assert seen.translation == pytest.approx(np.array(given["pose"]["position"]), abs=1e-8)
        assert abs(pin.log3(seen.rotation.T @ down)).max() < 1e-7
        assert plan.trajectory.velocity(one.time) == pytest.approx(np.zeros(8), abs=1e-9)
    turned = np.ptp([named(plan, t)["turn"] for t in np.linspace(0, plan.trajectory.end_time, 50)])
    assert turned > 0.1


def test_near_sets_positioner_at_fixed_poses(folder: Path) -> None:
    where = {**HOME, TILT: 0.3, "turn": -0.4}
    beside, on = pose(BESIDE, frame="base", near=where, name="beside"), pose(ON_PART, name="on")
    plan = passing_plan(task(folder, waypoints=[beside, on]))
    q, both = named(plan, 1.5), Composed(folder)
    assert (q[TILT], q["turn"]) == pytest.approx((0.3, -0.4), abs=1e-9)
    assert both.tool(q).translation == pytest.approx(np.array(BESIDE), abs=1e-8)


def test_keeps_speeds_and_free_turns_at_fixed_poses(folder: Path) -> None:
    """The tool passes at speed, and turns about its axis as it likes, seen from the cell."""
    passing = pose(BESIDE, frame="base", velocity={"linear": [0.05, 0.02, -0.03]}, name="by")
    del passing["stop"]
    tool = {"free": {"turn": "z"}}
    plan = passing_plan(task(folder, tool=tool, waypoints=[passing, pose([0, 0, 0.3], name="on")]))
    both = Composed(folder)
    here, speed = seen(lambda t: both.tool(named(plan, t)), 1.5)
    assert here.translation == pytest.approx(np.array(BESIDE), abs=1e-8)
    assert here.rotation[:, 2] == pytest.approx(np.array([0, 0, -1]), abs=1e-7)
    assert speed == pytest.approx(np.array([0.05, 0.02, -0.03]), abs=1e-5)
    assert plan.report.select(quantity="free_range", name="by")


@pytest.mark.exhaustive
def test_frozen_times_and_speeds_give_same_motion(folder: Path, tmp_path: Path) -> None:
    """Velocities that are chosen, at a pose in the cell and at one on the plate."""
    given = fetch(folder, limits={"acceleration": 10})
    given["waypoints"] = [{**one, "after": "fastest"} for one in given["waypoints"]]
    del given["waypoints"][5]["after"]
    given["waypoints"].insert(4, pose([0.05, -0.05, 0.3], name="by", after="fastest"))
    for i in (2, 4):
        del given["waypoints"][i]["stop"]
        given["waypoints"][i]["velocity"] = "free"
    plan = passing_plan(given)
    again = passing_plan(plan.freeze(tmp_path / "frozen.yaml"))
    times = again.scenario.times
    found, expected = again.trajectory.position(times), plan.trajectory.position(times)
    assert found == pytest.approx(expected, abs=1e-9)
    passed = [waypoint for waypoint in again.scenario.waypoints if waypoint.name in ("away", "by")]
    assert [np.linalg.norm(one.linear) > 0.01 for one in passed] == [True, True]


def test_check_fails_moved_fixed_pose_only(folder: Path) -> None:
    plan = kw.plan(fetch(folder))
    beside = fetch(folder)
    beside["waypoints"][1]["pose"]["position"][0] += 2e-5
    failed = kw.check(plan.trajectory, kw.load_scenario(beside)).failures
    assert {(one.quantity, one.name) for one in failed} == {("position", "pick")}
    part = {"on": "plate", "position": [0.05, 2e-5, 0.02], "rpy": [0, 0, 0.3]}
    moved = kw.load_scenario(fetch(folder, frames={"part": part}))
    names = {finding.name for finding in kw.check(plan.trajectory, moved).failures}
    assert {"place", "off", "end"} <= names
    assert not names & {"over", "pick", "away", "back"}


def box(plan: kw.Plan, both: Composed, t: float) -> pin.SE3:
    """Where the box is: in the cell, in the tool, on the plate."""
    if t < PICK:
        return tcp(both, named(plan, PICK)) * OFFSET
    if t < PLACE:
        return tcp(both, named(plan, t)) * OFFSET
    left = part(both, named(plan, PLACE)).actInv(tcp(both, named(plan, PLACE)) * OFFSET)
    return part(both, named(plan, t)) * left


def test_fetched_part_is_where_it_lies(folder: Path) -> None:
    """In the proof that the arm is clear of it, and in the page."""
    plan, both = kw.plan(fetch(folder)), Composed(folder)
    known = {waypoint.name: waypoint.time for waypoint in plan.scenario.waypoints}
    assert (known["pick"], known["place"]) == (PICK, PLACE)
    own = links(OfArm(plan), pin.SE3.Identity())
    fixed = {"shoulder_link", "upper_arm_link", "forearm_link"}
    check_box(plan, own, lambda t: box(plan, both, t), fixed)
    scene = scene_of(plan)
    time = times(scene)
    for t in (0.5, 4.0, 7.0, 10.7, 15.0):
        k = int(np.searchsorted(time, t))
        assert middle_of_held(scene, t, k) == pytest.approx(
            box(plan, both, float(time[k])).translation, abs=1e-3
        )
    labels = {one["text"]: one for one in scene["labels"] if one["kind"] == "waypoint"}
    for name, place in (("pick", BESIDE), ("place", None)):
        for k in (0, len(time) // 2, len(time) - 1):
            at = placed(scene, k)[labels[name].get("carrier", 0)].act(np.array(labels[name]["at"]))
            here = part(both, named(plan, float(time[k]))).act(np.array(ON_PART))
            assert at == pytest.approx(here if place is None else np.array(place), abs=1e-5)


def test_draws_held_box_in_cell_under_moved_plate(folder: Path) -> None:
    given = fetch(folder, near={**HOME, TILT: 0.3, "turn": -0.4})
    plan, both = kw.plan({**given, "waypoints": given["waypoints"][:4]}), Composed(folder)
    scene = scene_of(plan)
    for k in np.searchsorted(times(scene), [0.5, 4.0, 7.0]).tolist():
        t = float(times(scene)[k])
        assert middle_of_held(scene, t, k) == pytest.approx(
            box(plan, both, t).translation, abs=1e-3
        )


DELAY = 0.5


def at_table(plan: kw.Plan, both: Composed, base: pin.SE3) -> Bodies:
    """Links of an arm and its positioner over time, by name."""
    motion, arm = plan.trajectory, links(OfArm(plan), base)

    def at(t: float) -> dict[str, Any]:
        q = named(plan, float(np.clip(t, motion.start_time, motion.end_time)))
        table = {
            name: [(one, base * here) for one, here in placed]
            for name, placed in shapes(both, q).items()
        }
        return {**arm(t), **table}

    return at


def of_left(bodies: Bodies) -> Bodies:
    return lambda t: {f"left/{name}": placed for name, placed in bodies(t - DELAY).items()}


def facing(x: float) -> tuple[dict[str, Any], pin.SE3]:
    given = {"position": [x, 0.1, 0.0], "rpy": [0, 0, np.pi], "delay": DELAY}
    place = pin.SE3(pin.rpy.rpyToMatrix(*given["rpy"]), np.array(given["position"]))
    return given, place


@pytest.mark.parametrize(
    ("x", "clear"), mostly_exhaustive([(1.6, True), (1.1, False)], (1.6, True))
)
def test_other_robot_works_at_its_table(folder: Path, x: float, clear: bool) -> None:
    """Its base stands where the scene says, and its table turns beside it."""
    given, place = facing(x)
    left = {"scenario": str(written(folder / "table.yaml", task(folder))), **given}
    plan, other = kw.plan({**LEFT, "scene": {"robots": {"left": left}}}), kw.plan(task(folder))
    own = links(plan.trajectory, pin.SE3.Identity())
    moments = np.linspace(0.0, plan.trajectory.end_time, 100)
    check_pairs(plan.report, own, of_left(at_table(other, Composed(folder), place)), moments)
    assert plan.report.ok == clear


@pytest.mark.parametrize(
    ("at", "x", "clear"),
    mostly_exhaustive(
        [(True, 1.9, True), (True, 1.2, False), (False, 1.5, True), (False, 0.9, False)],
        (True, 1.2, False),
    ),
)
def test_checks_other_robot_next_to_table(folder: Path, at: bool, x: float, clear: bool) -> None:
    """It stands in the cell: with its own table, or without one."""
    given, place = facing(x)
    theirs = task(folder) if at else LEFT
    left = {"scenario": str(written(folder / "left.yaml", theirs)), **given}
    plan, other = kw.plan(task(folder)), kw.plan(theirs)
    scenario = kw.load_scenario(task(folder, scene={"robots": {"left": left}}))
    plan = replace(plan, scenario=scenario, report=kw.check(plan.trajectory, scenario))
    both = Composed(folder)
    own = at_table(plan, both, pin.SE3.Identity())
    there = at_table(other, both, place) if at else links(other.trajectory, place)
    moments = np.linspace(0.0, plan.trajectory.end_time, 60)
    check_pairs(plan.report, own, of_left(there), moments)
    assert plan.report.ok == clear
    scene = scene_of(plan)
    (label,) = (one for one in scene["labels"] if one["text"] == "left")
    for frame in (0, len(times(scene)) // 2):
        here = placed(scene, frame)[label.get("carrier", 0)].act(np.array(label["at"]))
        assert here == pytest.approx(place.translation, abs=1e-5)
