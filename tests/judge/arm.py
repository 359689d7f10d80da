"""`Arm`: the whole URDF as Pinocchio reads it, and what the robot's file says of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from judge.files import read_yaml
from judge.placing import placement

ROBOTS = Path(__file__).parents[2] / "robots"
DATA = next(p for p in Path(pin.__file__).parents if p.name == "cmeel.prefix") / "share"
EXAMPLES = "example-robot-data:"
STEP = 1e-5
KINDS = ("position", "velocity", "acceleration", "jerk", "effort")


def found(reference: str, folder: Path) -> Path:
    """A file that a robot's file names."""
    if reference.startswith(EXAMPLES):
        return DATA / "example-robot-data" / "robots" / reference.removeprefix(EXAMPLES)
    return folder / reference


def with_axes(arm: Any, axes: Mapping[str, Any]) -> Any:
    """A model with external axes: links `cell` and those of tables, and what carries the arm."""
    first = pin.Model()
    links = {"cell": first.addFrame(pin.Frame("cell", 0, 0, pin.SE3.Identity(), pin.BODY))}
    for name, one in axes.items():
        parent = first.frames[links[one.get("in", "cell")]]
        turn = pin.rpy.rpyToMatrix(*map(float, one.get("rpy", (0, 0, 0))))
        at = pin.SE3(turn, np.array(one.get("position", (0, 0, 0)), dtype=float))
        axis = np.array(one.get("turns") or one["slides"], dtype=float)
        axis /= np.linalg.norm(axis)
        kind = "Revolute" if one.get("turns") else "Prismatic"
        moving = getattr(pin, f"JointModel{kind}Unaligned")(axis)
        low, high = one.get("range") or (-np.inf, np.inf)
        fast = float(one.get("velocity") or 0.0)
        bounds = (np.array([value]) for value in (0.0, fast, low, high))
        joint = first.addJoint(parent.parentJoint, moving, parent.placement * at, name, *bounds)
        link = one.get("carries") or name
        links[link] = first.addFrame(pin.Frame(link, joint, 0, pin.SE3.Identity(), pin.BODY))
    carrier = links.get("robot", links["cell"])
    return pin.appendModel(first, arm, carrier, pin.SE3.Identity())


def mass_of(given: Mapping[str, Any], length: float) -> pin.Inertia:
    """The mass of a tool or of what it holds."""
    moments = given.get("inertia") or {}
    ixx, ixy, iyy, ixz, iyz, izz = (
        float(moments.get(key, 0.0)) for key in ("ixx", "ixy", "iyy", "ixz", "iyz", "izz")
    )
    centre = given.get("centre_of_mass", given.get("position", [0, 0, 0]))
    return pin.Inertia(
        float(given["mass"]),
        length * np.array(centre, dtype=float),
        np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]),
    )


class Arm:
    """A chain from a base to a tool; other joints stand still.

    Args:
        robot: Name of a shipped robot, path of a robot's file or URDF, or the keys of one.
        folder: Where relative paths start.
        tool: Of the scenario.
        length: The scenario's unit of length [m].
        angle: Its unit of angle [rad].
        gravity: In the axes of the base [m/s²].
        on: Link that poses are given in, if it is not the base.

    Attributes:
        ground: Where what poses are given in is at a time [s], seen from where it is at rest.
    """

    ground: Callable[[float], pin.SE3] | None = None

    def __init__(
        self,
        robot: str | Mapping[str, Any],
        folder: Path,
        tool: Mapping[str, Any],
        length: float,
        angle: float,
        gravity: list[float] | None,
        on: str | None = None,
    ) -> None:
        if isinstance(robot, str):
            path = folder / robot
            if "/" not in robot and (ROBOTS / f"{robot}.yaml").is_file():
                path = ROBOTS / f"{robot}.yaml"
            folder = path.parent
            robot = {"urdf": path.name} if path.suffix == ".urdf" else read_yaml(path)
        self.file, self.folder = robot, folder
        self.urdf = found(robot["urdf"], folder)
        self.model = pin.buildModelFromUrdf(str(self.urdf))
        axes = robot.get("external_axes") or {}
        if axes:
            self.model = with_axes(self.model, axes)
        root = "cell" if axes else self.model.frames[1].name
        self.moved = bool(axes)
        self.base_name, self.on = on or robot.get("base_frame") or root, on
        self.tool_name = tool.get("frame") or robot.get("tool_frame") or self.base_name
        offset = placement(tool.get("offset"), length, angle)
        carrier = self.model.frames[self.model.getFrameId(self.tool_name, pin.BODY)]
        self.tool_joint, self.tool_placement = carrier.parentJoint, carrier.placement.copy()
        self.tcp_placement = self.tool_placement * offset
        self._load(tool, length)
        self.tcp = self.model.addFrame(
            pin.Frame("judge's tool centre", self.tool_joint, self.tcp_placement, pin.OP_FRAME)
        )
        self._chain(robot.get("locked", {}))
        self.data = self.model.createData()
        pin.framesForwardKinematics(self.model, self.data, self.rest)
        self.base = self.data.oMf[self.model.getFrameId(self.base_name, pin.BODY)].copy()
        if gravity is not None:
            self.model.gravity.linear = self.base.rotation @ np.array(gravity, dtype=float)
        self.configurations = {
            name: np.array([values[joint] for joint in self.names])
            for name, values in robot.get("configurations", {}).items()
        }
        self.limits = self._limits(robot.get("limits", {}))

    def _load(self, tool: Mapping[str, Any], length: float) -> None:
        if tool.get("mass"):
            body = mass_of(tool, length)
            self.model.appendBodyToJoint(self.tool_joint, body, self.tool_placement)

    def _chain(self, locked: Mapping[str, float]) -> None:
        """The joints that move the tool, and where all the others stand."""
        base = self.model.frames[self.model.getFrameId(self.base_name, pin.BODY)].parentJoint
        to_base, to_tool = (list(self.model.supports[joint]) for joint in (base, self.tool_joint))
        chain = [joint for joint in to_tool[::-1] if joint not in to_base]
        chain += [joint for joint in to_base if joint not in to_tool]
        assert self.on or base in to_tool, "the base does not carry the tool"
        self.rest = pin.neutral(self.model)
        for name, value in locked.items():
            self._put(self.rest[None], self.model.getJointId(name), np.array([value]))
        self.joints = [j for j in reversed(chain) if self.model.names[j] not in locked]
        self.names = tuple(self.model.names[j] for j in self.joints)
        self.rates = [self.model.joints[j].idx_v for j in self.joints]
        slides = [self.model.joints[j].shortname().startswith("JointModelP") for j in self.joints]
        self.units = tuple("m" if one else "rad" for one in slides)

    def _put(self, q: np.ndarray, joint: int, values: np.ndarray) -> None:
        one = self.model.joints[joint]
        if one.nq == 1:
            q[:, one.idx_q] = values
        else:  # without limits: cosine and sine
            q[:, one.idx_q], q[:, one.idx_q + 1] = np.cos(values), np.sin(values)

    def _limits(self, given: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """Of the URDF, and those that replace them; position as pairs, shape (d, 2)."""
        limits = no_limits(len(self.names))
        for i, j in enumerate(self.joints):
            one = self.model.joints[j]
            if one.nq == 1:
                low, high = self.model.lowerPositionLimit, self.model.upperPositionLimit
                limits["position"][i] = low[one.idx_q], high[one.idx_q]
            for kind, values in (
                ("velocity", self.model.velocityLimit),
                ("effort", self.model.effortLimit),
            ):
                if 0.0 < values[one.idx_v] < 1e300:
                    limits[kind][i] = values[one.idx_v]
        return replaced(limits, given, self.names, np.ones(len(self.names)))

    def whole(self, q: np.ndarray) -> np.ndarray:
        """Joint positions, shape (k, d), as configurations of the whole model."""
        full = np.tile(self.rest, (len(q), 1))
        for i, joint in enumerate(self.joints):
            self._put(full, joint, q[:, i])
        return full

    def _rows(self, q: np.ndarray, *rates: np.ndarray) -> Iterator[tuple[np.ndarray, ...]]:
        """States of the whole model, from joint positions and their derivatives."""
        whole = np.zeros((len(rates), len(q), self.model.nv))
        whole[..., self.rates] = rates
        return zip(self.whole(q), *whole, strict=True)

    def poses(self, q: np.ndarray, t: np.ndarray | None = None) -> list[pin.SE3]:
        """Of the tool centre point in the base, at positions of shape (k, d).

        Times of shape (k,) are those at which what carries the poses is where it is.
        """
        base, found = self.base.inverse(), []
        frame = self.model.getFrameId(self.base_name, pin.BODY)
        for k, one in enumerate(self.whole(q)):
            pin.forwardKinematics(self.model, self.data, one)
            if self.on:
                base = pin.updateFramePlacement(self.model, self.data, frame).inverse()
            pose = base * pin.updateFramePlacement(self.model, self.data, self.tcp)
            if self.ground is not None and t is not None:
                pose = self.ground(float(t[k])).actInv(pose)
            found.append(pose)
        return found

    def _seen_velocities(self, q: np.ndarray, v: np.ndarray, t: np.ndarray) -> np.ndarray:
        """By differences, as they are seen from what carries the poses."""
        before, after = (self.poses(q + h * v, t + h) for h in (-STEP, STEP))
        return np.array(
            [
                np.concatenate((b.translation - a.translation, pin.log3(b.rotation @ a.rotation.T)))
                / (2 * STEP)
                for a, b in zip(before, after, strict=True)
            ]
        )

    def velocities(
        self, q: np.ndarray, v: np.ndarray, link: str | None = None, t: np.ndarray | None = None
    ) -> np.ndarray:
        """Linear and angular, of the tool centre point or a link's origin, in the base's axes."""
        if link is None and t is not None and (self.on or self.ground is not None):
            return self._seen_velocities(q, v, t)
        frame = self.tcp if link is None else self.model.getFrameId(link, pin.BODY)
        turn = self.base.rotation.T
        found = np.empty((len(q), 6))
        for k, row in enumerate(self._rows(q, v)):
            pin.forwardKinematics(self.model, self.data, *row)
            pin.updateFramePlacement(self.model, self.data, frame)
            moved = pin.getFrameVelocity(self.model, self.data, frame, pin.LOCAL_WORLD_ALIGNED)
            found[k] = np.concatenate((turn @ moved.linear, turn @ moved.angular))
        return found

    def accelerations(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Sizes of the tool centre point's acceleration [m/s²], shape (k,)."""
        found = np.empty(len(q))
        for k, row in enumerate(self._rows(q, v, a)):
            pin.forwardKinematics(self.model, self.data, *row)
            pin.updateFramePlacement(self.model, self.data, self.tcp)
            felt = pin.getFrameClassicalAcceleration(
                self.model, self.data, self.tcp, pin.LOCAL_WORLD_ALIGNED
            )
            found[k] = np.linalg.norm(felt.linear)
        return found

    def efforts(
        self, q: np.ndarray, v: np.ndarray, a: np.ndarray, held: pin.Inertia | None = None
    ) -> np.ndarray:
        """Torques and forces of the joints, by inverse dynamics, shape (k, d).

        What is held is a body at the tool centre point.
        """
        model = self.model.copy()
        if held is not None:
            model.appendBodyToJoint(self.tool_joint, held, self.tcp_placement)
        data = model.createData()
        found = [pin.rnea(model, data, *row)[self.rates] for row in self._rows(q, v, a)]
        return np.reshape(found, np.shape(q))

    def singular_values(self, q: np.ndarray) -> np.ndarray:
        """The smallest of the tool's Jacobian, shape (k,)."""
        found = np.empty(len(q))
        for k, one in enumerate(self.whole(q)):
            J = pin.computeFrameJacobian(
                self.model, self.data, one, self.tcp, pin.LOCAL_WORLD_ALIGNED
            )
            found[k] = np.linalg.svd(J[:, self.rates], compute_uv=False)[-1]
        return found


def no_limits(d: int) -> dict[str, np.ndarray]:
    """Infinite limits of so many joints; position as pairs, shape (d, 2)."""
    limits = {kind: np.full(d, np.inf) for kind in KINDS[1:]}
    return {**limits, "position": np.tile([-np.inf, np.inf], (d, 1))}


def replaced(
    limits: Mapping[str, np.ndarray],
    given: Mapping[str, Any],
    names: tuple[str, ...],
    scale: np.ndarray,
) -> dict[str, np.ndarray]:
    """Limits, some of them replaced by those of a file; `scale` is one of its units in SI."""
    limits = {kind: np.array(values) for kind, values in limits.items()}
    for kind in KINDS:
        values = given.get(kind)
        if values is None:
            continue
        for i, name in enumerate(names):
            factor = 1.0 if kind == "effort" else scale[i]
            if not isinstance(values, Mapping):
                limits[kind][i] = factor * float(values)
            elif name in values:
                limits[kind][i] = factor * np.array(values[name], dtype=float)
    return limits
