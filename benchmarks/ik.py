"""Inverse kinematics: how often it succeeds, how complete it is, how fast beside other solvers.

    python benchmarks/ik.py success   # 1,000 reachable poses for each arm, and poses at the edge
    python benchmarks/ik.py branches  # all solutions against closed forms
    python benchmarks/ik.py speed     # one solution, beside whatever else is installed

Run it on one thread (OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1). The other solvers are no
dependencies; for `speed` put them into an environment of their own beside Knotwork:

    python -m venv peers
    peers/bin/pip install . pin-pink mink pytracik roboticstoolbox-python EAIK quadprog

Those that are not there are shown as such. Every answer, whoever's it is, goes through the same
check: Pinocchio's forward kinematics within 1e-8 m and 1e-8 rad (a second figure counts 1e-4),
and joint limits. Solvers take turns pose by pose, so that a noisy machine disturbs all alike.
"""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np
import pinocchio as pin
from rich.console import Console
from rich.table import Table

import knotwork as kw
from knotwork.errors import KnotworkError, UnreachablePoseError
from knotwork.kinematics.joint_axes import JointAxes
from knotwork.robot import Robot, load_robot
from knotwork.waypoints import FloatArray

ARMS = ("ur3", "ur5", "ur10", "panda", "kinova", "xarm7", "z1", "talos_arm", "bravo7", "baxter")
BAXTER = {
    "name": "baxter",
    "urdf": "example-robot-data:baxter_description/urdf/baxter.urdf",
    "tool_frame": "left_gripper",
}
TOLERANCE = 1e-8
LOOSE = 1e-4
Solver = Callable[[Any, FloatArray], FloatArray | None]


def arm(name: str) -> Robot:
    """An arm by name: the shipped ones, and the left one of a Baxter."""
    return load_robot(BAXTER if name == "baxter" else name)


def box(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Where configurations are drawn from: the limits, no more than a turn of each joint."""
    lower = np.maximum(robot.lower_position_limit, -np.pi)
    return lower, np.minimum(robot.upper_position_limit, lower + 2 * np.pi)


def misses(robot: Robot, pose: Any, q: FloatArray | None) -> float:
    """How far an answer is off [m or rad]; infinite outside the limits or without one."""
    if q is None or not np.isfinite(q).all():
        return np.inf
    slack = 1e-9
    lower, upper = robot.lower_position_limit - slack, robot.upper_position_limit + slack
    if ((q < lower) | (q > upper)).any():
        return np.inf
    error = robot.forward(q).actInv(pose)
    return float(max(np.linalg.norm(error.translation), np.linalg.norm(pin.log3(error.rotation))))


def success(poses: int) -> Table:
    """Solved poses of each arm, from anywhere and from 0.1 rad away."""
    table = Table(title=f"Solved of {poses} reachable poses, and at the edge", title_justify="left")
    for column in ("arm", "from anywhere", "from 0.1 rad", "of these kept near", "at limits"):
        table.add_column(column)
    for name in ARMS:
        robot, generator = arm(name), np.random.default_rng(42)
        lower, upper = box(robot)
        counts = [0, 0, 0, 0]
        edge = max(1, poses // 10)
        for i in range(poses):
            q = generator.uniform(lower, upper)
            pose = robot.forward(q)
            start = generator.uniform(lower, upper)
            counts[0] += _solved(robot, pose, start) is not None
            near = np.clip(q + generator.uniform(-0.1, 0.1, robot.dof), lower, upper)
            found = _solved(robot, pose, near)
            counts[1] += found is not None
            if found is not None:
                away = np.linalg.norm(found - near)
                counts[2] += bool(away <= np.linalg.norm(q - near) + 1e-6)
            if i < edge:
                side = generator.integers(0, 3, robot.dof)
                q = np.select([side == 0, side == 1], [lower, upper], q)
                counts[3] += _solved(robot, robot.forward(q), start) is not None
        cells = [f"{counts[0]}/{poses}", f"{counts[1]}/{poses}", f"{counts[2]}/{counts[1]}"]
        table.add_row(name, *cells, f"{counts[3]}/{edge}")
    return table


def _solved(robot: Robot, pose: Any, start: FloatArray) -> FloatArray | None:
    try:
        q = kw.solve_pose_ik(robot, pose, start).q
    except KnotworkError:
        return None
    return q if misses(robot, pose, q) <= TOLERANCE else None


SINGULAR: dict[str, dict[str, dict[int, float]]] = {
    "ur5": {
        "wrist": {4: 0.0},
        "elbow": {2: 0.0},
        "wrist and elbow": {2: 0.0, 4: 0.0},
        "full stretch": {1: -np.pi / 2, 2: 0.0, 3: 0.0, 4: 0.0},
    },
    "panda": {"shoulder and wrist": {1: 0.0, 5: 0.0}, "straight": {1: 0.0, 2: 0.0, 5: 0.0}},
    "kinova": {"elbow": {2: np.pi}, "wrist": {4: np.pi}},
}


def singular(poses: int) -> Table:
    """Solved poses at singularities, and a pose a micrometre out of reach."""
    table = Table(title="At singularities, from anywhere", title_justify="left")
    for column in ("arm", "where", "solved"):
        table.add_column(column)
    for name, places in SINGULAR.items():
        robot, generator = arm(name), np.random.default_rng(43)
        lower, upper = box(robot)
        for where, fixed in places.items():
            solved = 0
            for _ in range(poses):
                q = generator.uniform(lower, upper)
                q[list(fixed)] = list(fixed.values())
                pose = robot.forward(q)
                solved += _solved(robot, pose, generator.uniform(lower, upper)) is not None
            table.add_row(name, where, f"{solved}/{poses}")
    solved = 0
    robot, generator = arm("ur5"), np.random.default_rng(44)
    lower, upper = box(robot)
    for _ in range(poses):
        q = _shoulder_singular(robot, generator.uniform(lower, upper))
        pose = robot.forward(q)
        solved += _solved(robot, pose, generator.uniform(lower, upper)) is not None
    table.add_row("ur5", "shoulder", f"{solved}/{poses}")
    planar = load_robot("planar2")
    stretched = planar.forward([0.3, 0.0])
    outward = stretched.translation / np.linalg.norm(stretched.translation)
    try:
        kw.solve_pose_ik(
            planar, pin.SE3(stretched.rotation, stretched.translation + 1e-6 * outward), [0.1, 0.1]
        )
        said = "accepted"
    except UnreachablePoseError as error:
        said = f"refused, {error.position_shortfall:.3g} m short"
    table.add_row("planar2", "1e-6 m out of reach", said)
    return table


def _shoulder_singular(robot: Robot, q: FloatArray) -> FloatArray:
    """Turn joint 2 of a UR arm until the wrist is above its shoulder axis."""
    from knotwork.kinematics.words import _functions, geometry

    found, chain = geometry(robot), JointAxes(robot)
    if found is None:
        raise RuntimeError("the arm has no shoulder")
    grid = np.linspace(-np.pi, np.pi, 721)

    def side(angle: float) -> float:
        turned = q.copy()
        turned[1] = angle
        return float(_functions(chain, found, turned[None])[0, 0])

    values = [side(angle) for angle in grid]
    for a, b, low, high in zip(grid, grid[1:], values, values[1:], strict=False):
        if low * high < 0:
            for _ in range(60):
                middle = 0.5 * (a + b)
                if side(middle) * low > 0:
                    a = middle
                else:
                    b = middle
            turned = q.copy()
            turned[1] = a
            return turned
    return _shoulder_singular(robot, np.roll(q, 1))


def branches(poses: int) -> Table:
    """All solutions of a UR5 and a spherical wrist against their closed forms."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "kinematics"))
    closed_form: Any = importlib.import_module("closed_form")
    table = Table(title=f"Branches found, {poses} poses", title_justify="left")
    for column in (
        "arm",
        "closed form",
        "found",
        "share",
        "a pose",
        "not in the closed form",
        "ms",
    ):
        table.add_column(column)
    turn = pin.SE3(pin.utils.rotate("z", np.pi), np.zeros(3))
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "spherical.urdf"
        path.write_text(closed_form.spherical_wrist_urdf(), encoding="utf-8")
        spherical = load_robot(path).with_tool("l7")
    truths: list[tuple[Robot, Callable[[Any], list[FloatArray]]]] = [
        (arm("ur5"), lambda pose: list(closed_form.ur5((turn * pose).homogeneous))),
        (spherical, lambda pose: list(closed_form.spherical_wrist(pose.homogeneous))),
    ]
    for robot, truth in truths:
        generator = np.random.default_rng(45)
        wanted = found = extra = 0
        seconds = 0.0
        for _ in range(poses):
            pose = robot.forward(generator.uniform(-np.pi, np.pi, 6))
            start = time.perf_counter()
            answers = np.array([branch.q for branch in kw.solve_all(robot, pose)])
            seconds += time.perf_counter() - start
            expected = truth(pose)
            hits = sum(
                bool((np.abs(closed_form.turned(answers - q)).max(axis=1) < 1e-5).any())
                for q in expected
            )
            wanted, found = wanted + len(expected), found + hits
            extra += len(answers) - hits
        cells = [wanted, found, f"{found / wanted:.3%}", f"{wanted / poses:.2f}", extra]
        table.add_row(robot.name, *map(str, cells), f"{1e3 * seconds / poses:.1f}")
    return table


def knotwork_first(robot: Robot) -> Solver:
    """Ours, the first solution."""
    return lambda pose, start: kw.solve_pose_ik(robot, pose, start, nearest=False).q


def knotwork_nearest(robot: Robot) -> Solver:
    """Ours, the nearest solution."""
    return lambda pose, start: kw.solve_pose_ik(robot, pose, start).q


def toolbox(robot: Robot) -> Solver:
    """Levenberg–Marquardt in C++ of the Robotics Toolbox, on the same axes."""
    rtb: Any = importlib.import_module("roboticstoolbox")
    ets = rtb.ETS()
    for step in JointAxes(robot)._steps:
        placement = np.eye(4)
        placement[:3, :3], placement[:3, 3] = step[:3].T, step[3]
        ets = ets * rtb.ET.SE3(placement) * rtb.ET.Rz()
    ets = rtb.ETS(list(ets)[:-1])  # after the tool there is no joint
    ets.qlim = np.array([robot.lower_position_limit, robot.upper_position_limit])

    def solve(pose: Any, start: FloatArray) -> FloatArray | None:
        answer = ets.ik_LM(pose.homogeneous, q0=start, tol=1e-17, ilimit=60, joint_limits=True)
        return np.asarray(answer[0], dtype=float)

    return solve


def trac_ik(robot: Robot) -> Solver:
    """TRAC-IK through pytracik."""
    pytracik: Any = importlib.import_module("pytracik")
    text = Path(robot.urdf).read_text(encoding="utf-8")
    solver = pytracik.TRAC_IK(
        robot.base_frame, robot.tool_frame, text, 0.02, 1e-9, pytracik.SolveType.Speed
    )

    def solve(pose: Any, start: FloatArray) -> FloatArray | None:
        x, y, z = pose.translation
        quaternion = pin.Quaternion(pose.rotation).coeffs()
        answer = np.asarray(pytracik.ik(solver, start, x, y, z, *quaternion), dtype=float)
        return answer[1:] if answer.size == robot.dof + 1 and answer[0] >= 0 else None

    return solve


def eaik(robot: Robot) -> Solver:
    """Closed forms by subproblems (EAIK): all branches, of which the nearest is taken."""
    module: Any = importlib.import_module("eaik.IK_HP")
    chain, home = JointAxes(robot), robot.forward(np.zeros(robot.dof))
    points = np.vstack([np.zeros(3), chain.origins, home.translation])
    solver = module.HPRobot(chain.axes, np.diff(points, axis=0))
    if not solver.hasKnownDecomposition():
        raise ValueError("no closed form")

    def solve(pose: Any, start: FloatArray) -> FloatArray | None:
        target = pose.homogeneous.copy()
        target[:3, :3] = target[:3, :3] @ home.rotation.T
        answer = solver.IK(target)
        found = [np.asarray(q) for q in answer.Q]
        away = [np.abs((q - start + np.pi) % (2 * np.pi) - np.pi).max() for q in found]
        return found[int(np.argmin(away))] if found else None

    return solve


def pink(robot: Robot) -> Solver:
    """Differential inverse kinematics by QP (Pink), iterated."""
    module: Any = importlib.import_module("pink")
    tasks: Any = importlib.import_module("pink.tasks")
    importlib.import_module("quadprog")
    frame = robot.model.frames[robot.tcp_frame_id].name
    model = robot.model.copy()
    model.lowerPositionLimit, model.upperPositionLimit = box(robot)
    task = tasks.FrameTask(frame, position_cost=1.0, orientation_cost=1.0, lm_damping=1e-6)
    data = model.createData()

    def solve(pose: Any, start: FloatArray) -> FloatArray | None:
        configuration = module.Configuration(model, data, start)
        task.set_target(robot.base_placement * pose)
        for _ in range(100):
            if np.linalg.norm(task.compute_error(configuration)) < TOLERANCE:
                break
            v = module.solve_ik(configuration, [task], 1.0, solver="quadprog", safety_break=False)
            configuration.integrate_inplace(v, 1.0)
        return np.array(configuration.q)

    return solve


PEERS: dict[str, Callable[[Robot], Solver]] = {
    "knotwork, first": knotwork_first,
    "knotwork, nearest": knotwork_nearest,
    "roboticstoolbox ik_LM": toolbox,
    "TRAC-IK (pytracik)": trac_ik,
    "EAIK": eaik,
    "pink": pink,
}


def speed(poses: int) -> Table:
    """Time of one solution, solvers in turn."""
    table = Table(title=f"One solution, {poses} poses, one thread [µs]", title_justify="left")
    columns = ("arm", "start", "solver", "mean", "median", "p99", "solved to 1e-8", "to 1e-4")
    for column in columns:
        table.add_column(column)
    for name in ("ur5", "panda"):
        robot, generator = arm(name), np.random.default_rng(46)
        lower, upper = box(robot)
        solvers: dict[str, Solver | str] = {}
        for peer, make in PEERS.items():
            try:
                solvers[peer] = make(robot)
            except ImportError:
                solvers[peer] = "not installed"
            except Exception as error:  # a peer may refuse an arm in a way of its own
                solvers[peer] = f"does not take this arm: {str(error).splitlines()[0][:60]}"
        q = generator.uniform(lower, upper, (poses, robot.dof))
        targets = [robot.forward(one) for one in q]
        random = generator.uniform(lower, upper, q.shape)
        near = np.clip(q + generator.uniform(-0.1, 0.1, q.shape), lower, upper)
        for label, starts in (("random", random), ("near", near)):
            _speed_rows(table, robot, label, solvers, targets, starts)
            start = time.perf_counter()
            answer = kw.solve_many(robot, targets, starts)
            mean = 1e6 * (time.perf_counter() - start) / poses
            off = [misses(robot, p, one) for p, one in zip(targets, answer.q, strict=True)]
            table.add_row(
                name, label, "knotwork, solve_many", f"{mean:.1f}", "-", "-", *_shares(off)
            )
    return table


def _shares(off: list[float]) -> tuple[str, str]:
    values = np.array(off)
    return f"{np.mean(values <= TOLERANCE):.1%}", f"{np.mean(values <= LOOSE):.1%}"


def _speed_rows(
    table: Table,
    robot: Robot,
    label: str,
    solvers: dict[str, Solver | str],
    targets: list[Any],
    starts: FloatArray,
) -> None:
    took: dict[str, list[float]] = {peer: [] for peer in solvers}
    off: dict[str, list[float]] = {peer: [] for peer in solvers}
    for pose, start in zip(targets, starts, strict=True):
        for peer, solve in solvers.items():
            if isinstance(solve, str):
                continue
            begin = time.perf_counter()
            try:
                answer = solve(pose, start)
            except Exception:  # whatever a peer raises counts as unsolved
                answer = None
            took[peer].append(time.perf_counter() - begin)
            off[peer].append(misses(robot, pose, answer))
    for peer, solve in solvers.items():
        if isinstance(solve, str):
            table.add_row(robot.name, label, peer, solve)
            continue
        values = 1e6 * np.array(took[peer])
        figures = (values.mean(), np.median(values), np.percentile(values, 99))
        table.add_row(
            robot.name, label, peer, *(f"{value:.0f}" for value in figures), *_shares(off[peer])
        )


@click.command()
@click.argument("what", type=click.Choice(["success", "branches", "speed"]))
@click.option("--poses", default=1000, show_default=True)
def main(what: str, poses: int) -> None:
    """Measure inverse kinematics and print a table."""
    console = Console(width=120)
    if what == "success":
        console.print(success(poses))
        console.print(singular(max(1, poses // 10)))
    elif what == "branches":
        console.print(branches(poses))
    else:
        console.print(speed(poses))


if __name__ == "__main__":
    main()
