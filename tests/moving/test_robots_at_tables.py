"""Two robots where joints move the base frame of one, or of both, against Pinocchio and Coal."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from drawn import placed
from moving.moving_truth import Bodies, OfArm, links
from moving.test_moving_things import LEFT, check_pairs, refused
from moving.test_placed_urdfs import Composed, folder, named, shapes, task, write
from moving.test_shown import scene_of, times
from sweeps import mostly_exhaustive

__all__ = ["folder"]
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


@pytest.mark.parametrize(("x", "clear"), [(1.6, True), (1.1, False)])
def test_other_robot_works_at_its_table(folder: Path, x: float, clear: bool) -> None:
    """Its base stands where the scene says, and its table turns beside it."""
    given, place = facing(x)
    left = {"scenario": str(write(folder / "table.yaml", task(folder))), **given}
    plan, other = kw.plan({**LEFT, "scene": {"robots": {"left": left}}}), kw.plan(task(folder))
    own = links(plan.trajectory, pin.SE3.Identity())
    moments = np.linspace(0.0, plan.trajectory.end_time, 100)
    check_pairs(plan.report, own, of_left(at_table(other, Composed(folder), place)), moments)
    assert plan.report.ok == clear


@pytest.mark.parametrize(
    ("at", "x", "clear"),
    mostly_exhaustive(
        [(True, 1.9, True), (True, 1.2, False), (False, 1.5, True), (False, 0.9, False)],
        *((True, 1.2, False), (False, 1.5, True)),
    ),
)
def test_checks_other_robot_next_to_task_on_table(
    folder: Path, at: bool, x: float, clear: bool
) -> None:
    """It stands in the cell: with its own table, or without one."""
    given, place = facing(x)
    theirs = task(folder) if at else LEFT
    left = {"scenario": str(write(folder / "left.yaml", theirs)), **given}
    plan, other = kw.plan(task(folder)), kw.plan(theirs)
    asked = kw.load_scenario(task(folder, scene={"robots": {"left": left}}))
    plan = replace(plan, scenario=asked, report=kw.check(plan.trajectory, asked))
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


def test_refuses_other_robot_on_table(folder: Path) -> None:
    left = {"scenario": str(write(folder / "left.yaml", LEFT)), "in": "part"}
    said = refused(task(folder, scene={"robots": {"left": left}}))
    assert "scene.robots.left.in: frame 'part' moves; the robot's base must not" in said
