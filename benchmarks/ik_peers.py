"""Other solvers behind one call: a pose and a start in, joint positions or nothing out.

Each is set up to reach 1e-8 m and 1e-8 rad if it can.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

import knotwork as kw
from ik_arms import TOLERANCE, Solver, box
from knotwork.arrays import FloatArray
from knotwork.robot import Robot
from knotwork.robot.joint_axes import JointAxes
from knotwork.robot.joint_tree import joint_tree


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
    joints, tool = joint_tree(robot.model), robot.model.frames[robot.require_tool()]
    step = robot.base_placement.inverse()
    for i in range(1, robot.dof + 1):
        along = pin.SE3(joints.alignment[i], np.zeros(3))
        step = step * pin.SE3(joints.rotation[i], joints.translation[i]) * along
        ets = ets * rtb.ET.SE3(step.homogeneous) * rtb.ET.Rz()
        step = along.inverse()
    ets = ets * rtb.ET.SE3((step * tool.placement).homogeneous)
    ets.qlim = np.array([robot.limits.lower, robot.limits.upper])

    def solve(pose: Any, start: FloatArray) -> FloatArray | None:
        answer = ets.ik_LM(pose.homogeneous, q0=start, tol=1e-17, ilimit=60, joint_limits=True)
        return np.asarray(answer[0], dtype=float)

    return solve


def trac_ik(robot: Robot) -> Solver:
    """TRAC-IK through pytracik."""
    pytracik: Any = importlib.import_module("pytracik")
    text = bare_urdf(robot)
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
        # beside solutions it gives least-squares answers, which are none
        found = [np.asarray(q) for q, ls in zip(answer.Q, answer.is_LS, strict=True) if not ls]
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


def tuned_loop(robot: Robot) -> Solver:  # noqa: C901 (calls of functions would cost time)
    """A tuned Levenberg–Marquardt loop on Pinocchio: what one would write for speed alone.

    LAPACK's `posv` directly, joints at a limit taken out and steps clipped only where a joint is
    at one, no name looked up twice, random restarts. It checks and verifies nothing.
    """
    from scipy.linalg.lapack import dposv

    model, data, frame = robot.model, robot.model.createData(), robot.tcp_frame_id
    lower, upper = robot.limits.lower, robot.limits.upper
    lows, highs = lower.tolist(), upper.tolist()
    base, eye = robot.base_placement, np.eye(robot.dof)
    anywhere = np.random.default_rng(0).uniform(*box(robot), (200, robot.dof))
    joints, place, log6 = pin.computeJointJacobians, pin.updateFramePlacement, pin.log6
    jacobian, local = pin.getFrameJacobian, pin.LOCAL

    def search(target: Any, q: FloatArray) -> FloatArray | None:
        joints(model, data, q)
        e = log6(place(model, data, frame).actInv(target)).vector
        square, factor, mark, at_limit, accepted = e.dot(e), 1e-2, np.inf, False, True
        for iteration in range(60):
            if square < 1e-17:
                return q
            if iteration % 6 == 5:
                if square > 0.25 * mark:
                    return None
                mark = square
            if accepted:
                J = jacobian(model, data, frame, local)
                JT = J.T
                H, gradient = JT.dot(J), JT.dot(e)
                if at_limit:
                    held = ((q <= lower) & (gradient < 0)) | ((q >= upper) & (gradient > 0))
                    if held.any():
                        gradient[held] = 0.0
                        H[held] = H[:, held] = 0.0
            step = dposv(H + (factor * square + 1e-12) * eye, gradient)[1]
            moves = step.tolist()
            longest = max(max(moves), -min(moves))
            if longest > 1.0:
                step *= 1.0 / longest
            trial, clipped = q + step, False
            for angle, low, high in zip(trial.tolist(), lows, highs):  # noqa: B905 (slower)
                if not low < angle < high:
                    trial, clipped = np.minimum(np.maximum(trial, lower), upper), True
                    break
            joints(model, data, trial)
            error = log6(place(model, data, frame).actInv(target)).vector
            trial_square = error.dot(error)
            accepted = trial_square < square
            if accepted:
                q, e, square, at_limit = trial, error, trial_square, clipped
                factor = max(0.2 * factor, 1e-2)
            else:
                factor *= 8.0
        return None

    def solve(pose: Any, start: FloatArray) -> FloatArray | None:
        target = base * pose
        found = search(target, start)
        for point in anywhere if found is None else ():
            found = search(target, point)
            if found is not None:
                break
        return found

    return solve


def ssik(robot: Robot) -> Solver:
    """Closed forms, or for seven joints a sweep of them (ssik): the solution nearest the start."""
    module: Any = importlib.import_module("ssik")
    chain, home = JointAxes(robot), robot.forward(np.zeros(robot.dof))
    points = np.vstack([np.zeros(3), chain.origins, home.translation])
    limits = np.column_stack([robot.limits.lower, robot.limits.upper])
    arm = module.Manipulator.from_axes(chain.axes, np.diff(points, axis=0), limits=limits)
    arm.prepare()
    turned = np.linalg.inv(arm.fk(np.zeros(robot.dof))) @ home.homogeneous

    def solve(pose: Any, start: FloatArray) -> FloatArray | None:
        target = pose.homogeneous @ np.linalg.inv(turned)
        answers = arm.solve(target, max_solutions=1, q_seed=start)
        return np.asarray(answers[0].q) if answers else None

    return solve


def bare_urdf(robot: Robot) -> str:
    """The URDF of chain and masses alone; joints that are not planned for are fixed."""
    tree = ElementTree.parse(robot.urdf)
    root = tree.getroot()
    for element in list(root):
        if element.tag not in ("link", "joint"):
            root.remove(element)
        for child in list(element):
            if child.tag in ("visual", "collision", "mimic", "safety_controller"):
                element.remove(child)
        if element.tag == "joint" and element.get("name") not in robot.joint_names:
            element.set("type", "fixed")
    first = root_link(root)
    for inertia in first.findall("inertial"):  # KDL takes none at the root
        first.remove(inertia)
    return ElementTree.tostring(root, encoding="unicode")


def root_link(root: ElementTree.Element) -> ElementTree.Element:
    """The link that is no joint's child."""
    children = {child.get("link") for child in root.iter("child")}
    (first,) = [link for link in root.iter("link") if link.get("name") not in children]
    return first


def mink(robot: Robot) -> Solver:
    """Differential inverse kinematics by QP on MuJoCo (mink), iterated."""
    module: Any = importlib.import_module("mink")
    mujoco: Any = importlib.import_module("mujoco")
    compiler = (
        '<mujoco><compiler fusestatic="false" boundmass="0.001" boundinertia="0.001" '
        'balanceinertia="true" strippath="true"/></mujoco>'
    )
    text = bare_urdf(robot).replace("</robot>", f"{compiler}</robot>")
    model = mujoco.MjModel.from_xml_string(text)
    order = [model.joint(name).qposadr[0] for name in robot.joint_names]
    configuration = module.Configuration(model)
    task = module.FrameTask(robot.tool_frame, "body", 1.0, 1.0, lm_damping=1e-6)
    limits = [module.ConfigurationLimit(model)]
    offset = robot.tool_offset.inverse()

    def solve(pose: Any, start: FloatArray) -> FloatArray | None:
        q = np.zeros(model.nq)
        q[order] = start
        configuration.update(q)
        target = robot.base_placement * pose * offset
        task.set_target(module.SE3.from_matrix(target.homogeneous))
        for _ in range(100):
            if np.linalg.norm(task.compute_error(configuration)) < TOLERANCE:
                break
            v = module.solve_ik(
                configuration, [task], 1.0, "daqp", damping=1e-12, limits=limits, safety_break=False
            )
            configuration.integrate_inplace(v, 1.0)
        return np.array(configuration.q[order])

    return solve


def drake(robot: Robot) -> Solver:
    """Nonlinear optimisation with SNOPT (Drake's InverseKinematics)."""
    plant_module: Any = importlib.import_module("pydrake.multibody.plant")
    parsing: Any = importlib.import_module("pydrake.multibody.parsing")
    kinematics: Any = importlib.import_module("pydrake.multibody.inverse_kinematics")
    solvers: Any = importlib.import_module("pydrake.solvers")
    maths: Any = importlib.import_module("pydrake.math")
    plant = plant_module.MultibodyPlant(0.0)
    parsing.Parser(plant).AddModelsFromString(bare_urdf(robot), "urdf")
    first = root_link(ElementTree.fromstring(bare_urdf(robot))).get("name")
    if first != "world":
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(first))
    plant.Finalize()
    tool, world = plant.GetFrameByName(robot.tool_frame), plant.world_frame()
    order = [plant.GetJointByName(name).position_start() for name in robot.joint_names]
    offset = robot.tool_offset.inverse()
    options = solvers.SolverOptions()
    for name in ("Major feasibility tolerance", "Minor feasibility tolerance"):
        options.SetOption(solvers.SnoptSolver.id(), name, 1e-9)
    snopt = solvers.SnoptSolver()

    def solve(pose: Any, start: FloatArray) -> FloatArray | None:
        target = robot.base_placement * pose * offset
        problem = kinematics.InverseKinematics(plant)
        point, zero = target.translation, np.zeros(3)
        problem.AddPositionConstraint(tool, zero, world, point, point)
        turn = maths.RotationMatrix(target.rotation)
        problem.AddOrientationConstraint(world, turn, tool, maths.RotationMatrix(), 0.0)
        guess = np.zeros(plant.num_positions())
        guess[order] = start
        result = snopt.Solve(problem.prog(), guess, options)
        return np.asarray(result.GetSolution(problem.q()))[order] if result.is_success() else None

    return solve


PEERS: dict[str, Callable[[Robot], Solver]] = {
    "knotwork, first": knotwork_first,
    "knotwork, nearest": knotwork_nearest,
    "tuned loop": tuned_loop,
    "roboticstoolbox ik_LM": toolbox,
    "TRAC-IK (pytracik)": trac_ik,
    "EAIK": eaik,
    "ssik": ssik,
    "pink": pink,
    "mink": mink,
    "drake": drake,
}
