"""What Knotwork plans and passes, the judge passes too: it shares nothing with it.

What is shipped is judged in `tests/test_shipped_scenarios.py`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from judge.arm import Arm
from judge.cases import Shelf, bumped
from judge.faults_of_paths import Along, Way, covered, path_case
from judge.task import Task
from judge.verdict import judge
from judged import judged
from sweeps import first_of

ARMS = ("ur3", "ur5", "ur10", "panda", "kinova", "xarm7", "z1")
PLANNERS = ("modified-hermite", "cubic", "quintic", "septic")


def by_joints(rng: np.random.Generator) -> dict[str, Any]:
    """Bare joints through random values, with a stop and a wait."""
    d = int(rng.integers(1, 4))
    names = [f"joint {i + 1}" for i in range(d)]

    def values(size: float) -> dict[str, float]:
        return dict(zip(names, (size * rng.normal(size=d)).tolist(), strict=True))

    rows: list[dict[str, Any]] = [{"joints": values(1.0)}]
    for _ in range(int(rng.integers(1, 5))):
        how: Any = [{"velocity": values(0.5)}, {"stop": True}, {"wait": 0.5}][rng.integers(3)]
        rows.append({"joints": values(1.0), "after": float(rng.uniform(0.3, 3.0)), **how})
    rows.append({"joints": values(1.0), "after": float(rng.uniform(0.3, 3.0))})
    planner = str(rng.choice(PLANNERS))
    return {"planner": planner, "continuity": 1 if planner == "cubic" else 2, "waypoints": rows}


def along_paths(rng: np.random.Generator) -> dict[str, Any]:
    """An arm that follows a line, an arc or points, turning or not, and waits."""
    robot = str(rng.choice(ARMS))
    arm = Arm(robot, Path(), {}, 1.0, 1.0, None)
    home = arm.configurations["home"]
    here = arm.poses(home[None])[0]

    def pose(place: np.ndarray, turn: float = 0.0) -> dict[str, Any]:
        R = here.rotation @ pin.exp3(rng.normal(size=3) * turn)
        return {"position": place.tolist(), "rotation_matrix": R.tolist()}

    def step(length: float) -> np.ndarray:
        way = rng.normal(size=3)
        return np.asarray(length * way / np.linalg.norm(way))

    start = here.translation + step(0.05)
    end = start + step(rng.uniform(0.05, 0.15))
    aside = np.cross(end - start, rng.normal(size=3))
    aside *= 0.4 * np.linalg.norm(end - start) / np.linalg.norm(aside)
    kind = int(rng.integers(4))
    along: Any = "line"
    if kind == 1:
        along = {"arc": {"through": (0.5 * (start + end) + aside).tolist()}}
    elif kind == 2:
        along = {"points": [(start + u * (end - start) + 2 * u * (1 - u) * aside).tolist()
                            for u in (0.2, 0.4, 0.6, 0.8)]}  # fmt: skip
    elif kind == 3:  # once around
        along, end = {"arc": {"centre": (start + aside).tolist()}}, start
        along["arc"]["normal"] = np.cross(aside, rng.normal(size=3)).tolist()
    path: dict[str, Any] = {"name": "end", "along": along, "speed": float(rng.uniform(0.02, 0.1))}
    path["pose"] = {"position": end.tolist()}
    if rng.random() < 0.4 and kind != 3:
        path["pose"] = pose(end, 0.2)
    elif rng.random() < 0.5 and kind in (1, 3):
        path["orientation"] = "tangent"
    stops: Any = [{}, {"stop": True}, {"wait": 0.3}]
    away = end + step(0.05)
    rows = [
        {"name": "begin", "after": 3.0, "pose": pose(start), **stops[rng.integers(3)]},
        {**path, **stops[rng.integers(3)]},
        {"name": "away", "after": 3.0, "pose": pose(away, 0.1)},
    ]
    return {"robot": robot, "start": "home", "waypoints": rows}


@pytest.mark.parametrize("count", first_of(8, 150))
def test_the_judge_passes_what_is_planned_through_joint_values(count: int) -> None:
    passed = 0
    for seed in range(count):
        data = by_joints(np.random.default_rng([1, seed]))
        plan = kw.plan(data)
        passed += plan.report.ok
        assert judged(plan, data) == [], seed
    assert passed > 0.8 * count


@pytest.mark.parametrize("count", first_of(2, 80))
def test_the_judge_passes_what_is_planned_along_paths(count: int) -> None:
    passed = 0
    for seed in range(count):
        data = along_paths(np.random.default_rng([2, seed]))
        try:
            plan = kw.plan(data)
        except kw.InputError:  # out of reach, or too sharp
            continue
        passed += plan.report.ok
        assert judged(plan, data) == [], seed
    assert passed > 0.4 * count


def ramped(along: Along, width: float) -> Way:
    """Progress whose ramps take a part of their time only, at its middle."""
    one = along.stretch

    def rise(t: np.ndarray, start: float, end: float) -> np.ndarray:
        """What a ramp from rest covers in between."""
        middle, half = 0.5 * (start + end), 0.5 * width * (end - start)
        return one.speed * covered(t, middle - half, middle + half)

    return lambda t: rise(t, one.start, one.full[0]) - rise(t, one.full[1], one.end)


@pytest.mark.parametrize("count", first_of(12, 72))
def test_other_allowed_ramps_pass(count: int, tmp_path: Path) -> None:
    """Late in its ramps by up to turns, and a little aside."""
    make = path_case("line", "arc", "circle", "turns", "points", ramps=0.98)
    for seed in range(count):
        rng = np.random.default_rng([3, seed])
        case = make(rng, Shelf(tmp_path))
        along = case.extra["along"]
        motion = along.motion(ramped(along, rng.uniform(0.4, 1.0)), 600)
        middle, half = 0.5 * motion.x[-1], 0.4 * motion.x[-1]
        bent = np.linalg.norm(along.path.at(np.linspace(0, along.path.length, 200))[2], axis=1)
        # neither its turn nor its speed along the path is another one beside it
        most = min(
            case.data["tolerances"]["path"],
            0.005 / (abs(along.rate) + 1e-9),
            case.extra["part"] / (bent.max() + 1e-9),
            case.extra["part"] * along.stretch.speed * half,
        )
        aside = rng.uniform(0.0, 0.3) * most
        motion = bumped(motion, int(rng.integers(3)), middle, half, aside)
        curve = kw.PiecewisePolynomial(motion.c, motion.x)
        units = ("m", "m", "m", "rad")
        checked = kw.JointTrajectory(motion.names, curve, joint_units=units)
        report = kw.check(checked, kw.load_scenario(case.data))
        assert report.ok, (seed, report.failures)
        assert {finding.proof for finding in report.select(group="Tool paths")} == {"bounded"}
        assert judge(Task(case.data, tmp_path), motion) == [], seed
