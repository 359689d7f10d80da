"""How near two motions come to one another, against plain Pinocchio and Coal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from command_line import Command
from knotwork.planning import clearance_between
from moving.moving_truth import distance, links, sampled
from moving.test_moving_things import LEFT, other_arm
from texts import written
from urdfs import collision, joint, limits, link, robot

WIDE = limits(-4, 4, velocity=9, effort=9)


def turning_bar(name: str, x: float, parent: str = "cell") -> str:
    """Links and joints of a bar of 1 m that turns about its end."""
    return (
        link(name, collision('<box size="1 0.1 0.1"/>', "0.5 0 0"))
        + link(f"{name} tip")
        + joint(f"{name} turn", parent, name, at=f"{x} 0 0", more=WIDE)
        + joint(f"{name} end", name, f"{name} tip", "fixed")
    )


@pytest.fixture
def cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> kw.Plan:
    """A plan in a folder with the files a.yaml, b.yaml and the plan b."""
    monkeypatch.chdir(tmp_path)
    frames = {
        name: {"position": [x, 0, 0], "rpy": [0, 0, np.pi]}
        for name, x in (("left", 0.9), ("near", 0.6))
    }
    belt = {"position": [1, 0, 0], "moves": {"linear": [0, 1, 0]}}
    kw.Task(**LEFT, frames={**frames, "belt": belt}).save("a.yaml")
    kw.Task(**LEFT).save("b.yaml")
    plan = kw.plan("b.yaml")
    plan.save("b")
    return plan


def least(plan: kw.Plan, apart: float, delay: float) -> float:
    """The least distance of two arms that face each other [m]."""
    there, own = other_arm(apart), links(plan.trajectory, pin.SE3.Identity())
    times = np.linspace(0.0, plan.trajectory.end_time, 100)
    rows = sampled(own, lambda t: there(t - delay), times)
    return min(float(row.min()) for row in rows.values())


def test_reports_clearance_of_two_motions(cell: kw.Plan, knotwork: Command) -> None:
    nearest = least(cell, 0.9, 0.5)
    for more in (("--with", "b.yaml"), ("--with", "b"), ("--with", "b.yaml", "--motion", "b")):
        ran = knotwork("check", "a.yaml", *more, "--in", "left", "--delay", "0.5s")
        assert (ran.code, ran.out.count("\n")) == (0, 1), ran.err
        assert ran.out.startswith("clear: ")
        shown = float(ran.out.split("comes within ")[1].split(" m")[0])
        assert nearest - 3e-4 < shown < nearest + 3e-4
    ran = knotwork("check", "b", "--scenario", "a.yaml", "--with", "b.yaml", "--in", "near")
    assert (ran.code, ran.out.count("\n")) == (1, 1)
    assert ran.out.startswith("TOO NEAR: ")
    assert "b/forearm_link at 0.0" in ran.out
    assert "too near from 0.000 s" in ran.out


def test_two_urdfs_need_frame_and_no_delay(cell: kw.Plan, knotwork: Command) -> None:
    kw.Task(**{**LEFT, "robot": "ur10"}).save("c.yaml")
    err = knotwork("check", "a.yaml", "--with", "c.yaml").refused()
    assert "their URDFs are not the same; accepted: --in with a frame of a.yaml" in err
    ran = knotwork("check", "a.yaml", "--with", "b.yaml", "--in", "left", "--delay", "0s")
    assert (ran.code, ran.out.startswith("clear: ")) == (0, True)
    assert knotwork("check", "a.yaml", "--with", "b.yaml", "--in", "base").code == 1


@pytest.mark.parametrize(("end", "clear"), [(2.0, True), (2.6, False)])
def test_two_arms_of_one_urdf_share_cell(tmp_path: Path, end: float, clear: bool) -> None:
    """Links of each arm stand once: none where the model of the other has it at rest."""
    turns = {"left": (1.6, 0.9), "right": (1.6, end)}
    bars = (turning_bar("left", 0), turning_bar("right", 1.3))
    urdf = written(tmp_path / "bars.urdf", robot(link("cell"), *bars))

    def task(side: str) -> dict[str, Any]:
        angles = [{"joints": {f"{side} turn": angle}} for angle in turns[side]]
        robot = {"urdf": str(urdf), "tool_frame": f"{side} tip"}
        return {"robot": robot, "waypoints": [angles[0], {**angles[1], "after": 2}]}

    right = kw.Task(**task("right")).save(tmp_path / "right.yaml")
    left, other = kw.plan(task("left")), kw.plan(right)
    found = clearance_between(left.trajectory, left.scenario, {"scenario": str(right)})

    def bar(plan: kw.Plan, x: float, t: float) -> list[Any]:
        turn = pin.rpy.rpyToMatrix(0, 0, float(plan.trajectory.position(t)[0]))
        at = pin.SE3(turn, np.array([x, 0, 0])) * pin.SE3(np.eye(3), np.array([0.5, 0, 0]))
        return [(coal.Box(1, 0.1, 0.1), at)]

    times = np.linspace(0.0, 2.0, 400).tolist()
    truth = min(distance(bar(left, 0.0, t), bar(other, 1.3, t)) for t in times)
    assert found.ok == clear == (truth > 0.0)
    assert found.name == "left, right/right"
    if clear:
        assert found.value == pytest.approx(truth, abs=3e-4)


@pytest.mark.parametrize(
    ("left", "right", "words"),
    [
        (None, 0.0, "joint 'torso turn' is moved by the motion of .* and carries the arm of"),
        (0.0, None, "joint 'torso turn' is moved by the motion of .* and carries the arm of"),
        (0.0, 0.5, "joint 'torso turn' is at 0 for .* and at 0.5 for"),
        (0.5, 0.5, None),
    ],
)
def test_refuses_arms_on_torso_moved_by_one_motion(
    tmp_path: Path, left: float | None, right: float | None, words: str | None
) -> None:
    """Else one arm would stand where the other one's torso is not."""
    torso = link("torso") + joint("torso turn", "cell", "torso", more=WIDE)
    bars = (turning_bar("left", 0, "torso"), turning_bar("right", 1.3, "torso"))
    urdf = written(tmp_path / "torso.urdf", robot(link("cell"), torso, *bars))

    def task(side: str, at: float | None) -> kw.Task:
        robot: dict[str, Any] = {"urdf": str(urdf), "tool_frame": f"{side} tip"}
        more = {"torso turn": 0.3} if at is None else {}
        if at is not None:
            robot["locked"] = {"torso turn": at}
        joints = [{"joints": {f"{side} turn": angle, **more}} for angle in (1.6, 1.5)]
        return kw.Task(robot=robot, waypoints=[joints[0], {**joints[1], "after": 2}])

    other = task("right", right).save(tmp_path / "right.yaml")
    plan = kw.plan(task("left", left))
    both = (plan.trajectory, plan.scenario, {"scenario": str(other)})
    if words is None:
        assert clearance_between(*both).ok
        return
    with pytest.raises(kw.InputError, match=words):
        clearance_between(*both)
