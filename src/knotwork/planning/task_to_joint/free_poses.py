"""Virtual joints: a pose with a freedom is a complete pose of a longer chain.

Joint positions of the longer chain are found like those of any redundant arm. At a pose without
freedom the virtual joints are at 0. They are removed from the solution.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray, IndexArray
from knotwork.curves.tool_paths.rotations import rotation_matrices
from knotwork.errors import BranchError
from knotwork.robot import Robot
from knotwork.robot.kinematics.geometry.configuration_flags import configuration_flags
from knotwork.robot.kinematics.sequence.candidates import Candidates
from knotwork.robot.robot_spec import VirtualJoint
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_reader import JointState
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.waypoints import CartesianWaypoint, PoseFreedom, TorchRanges

if TYPE_CHECKING:
    import pinocchio as pin

TORCH_RANGE_SHARE = 0.95
"""Fraction of a torch's ranges that its joints use: between waypoints they may exceed it a bit."""


class FreedomChain(NamedTuple):
    """The arm with the virtual joints of one freedom.

    Attributes:
        robot: The arm followed by the virtual joints.
        columns: Indices of this chain's joints in the combined joint vector, shape (d,).
        size: Length of the combined joint vector.
    """

    robot: Robot
    columns: IndexArray
    size: int

    @property
    def with_soft_limits(self) -> FreedomChain:
        """The chain with virtual joints that slow down before their limits."""
        joints = self.robot.virtual_joints
        slowing = [replace(joint, slows_at_limits=True, mobility=1.0) for joint in joints]
        return self._replace(robot=self.robot.with_virtual_joints(*slowing))

    def scatter(self, values: FloatArray, default: FloatArray | float = 0.0) -> FloatArray:
        """Scatter values (..., d) of this chain into combined joint vectors, shape (..., size)."""
        result = np.zeros((*values.shape[:-1], self.size)) + default
        result[..., self.columns] = values
        return result

    def expand(self, candidates: Candidates, robot: Robot, default: FloatArray) -> Candidates:
        """Convert candidates to those of the arm with the virtual joints of all freedoms.

        Joints that do not move the tool relative to the pose (such as that of a table) have the
        values in `default`.
        """
        if self.robot is robot:
            return candidates
        default = np.where(robot.is_virtual, 0.0, default)
        q, velocity = self.scatter(candidates.q, default), self.scatter(candidates.velocity)
        return candidates._replace(q=q, velocity=velocity, flags=configuration_flags(robot, q))


class FreedomChains:
    """The arm with virtual joints, one chain for each freedom that poses of a scenario have.

    Args:
        scenario: The scenario.
        robot: The arm.

    Attributes:
        arm: The arm.
        arm_with_freedoms: The arm with the virtual joints of all freedoms, common joints once.

    Raises:
        BranchError: The scenario asks for a branch, and a pose has a freedom.
    """

    def __init__(self, scenario: Scenario, robot: Robot) -> None:
        poses = [pose for pose in scenario.waypoints if isinstance(pose, CartesianWaypoint)]
        first = next((pose for pose in poses if pose.freedom is not None), None)
        if first is not None and scenario.branch != "free":
            raise BranchError(
                first.name,
                "is free, so its solutions are connected and it has no branches; in place of "
                "branch give near: a configuration",
                branches=(),
                where=first.where,
            )
        self.arm = robot
        freedoms = dict.fromkeys(pose.freedom for pose in poses if pose.freedom is not None)
        joints_of: dict[PoseFreedom | None, list[VirtualJoint]] = {None: []}
        joints_of |= {freedom: _virtual_joints(freedom) for freedom in freedoms}
        shared = _merge_joints([joint for joints in joints_of.values() for joint in joints])
        column_of = {kind: robot.dof + k for k, kind in enumerate(shared)}
        self.arm_with_freedoms = robot.with_virtual_joints(*shared.values()) if shared else robot
        self._chains: dict[tuple[bool, PoseFreedom | None], FreedomChain] = {}
        in_base = [(False, freedom) for freedom in joints_of]
        of_poses = [(True, pose.freedom) for pose in poses if pose.in_world_frame]
        for in_world_frame, freedom in dict.fromkeys([*in_base, *of_poses]):
            arm, moving = robot.robot_and_columns(in_world_frame=in_world_frame)
            joints = joints_of[freedom]
            columns = [*moving, *(column_of[_kind(joint)] for joint in joints)]
            chain = arm.with_virtual_joints(*joints) if joints else arm
            if len(columns) == self.arm_with_freedoms.dof and all(
                map(operator.is_, joints, shared.values())
            ):
                chain = self.arm_with_freedoms
            self._chains[in_world_frame, freedom] = FreedomChain(
                chain, np.array(columns), self.arm_with_freedoms.dof
            )

    def __iter__(self) -> Iterator[FreedomChain]:
        return iter(self._chains.values())

    def for_freedom(self, freedom: PoseFreedom | None) -> FreedomChain:
        """The chain of a freedom, for poses in the base frame."""
        in_world_frame = False
        return self._chains[in_world_frame, freedom]

    def for_waypoint(self, waypoint: object) -> FreedomChain:
        """The chain at a waypoint: the arm alone where joint positions are given."""
        if not isinstance(waypoint, CartesianWaypoint):
            return self.for_freedom(None)
        return self._chains[waypoint.in_world_frame, waypoint.freedom]


def with_virtual_joints(
    scenario: Scenario, joints: ScenarioJoints, chains: FreedomChains
) -> ScenarioJoints:
    """The joints with the virtual joints of the scenario's freedoms appended, if any.

    Args:
        scenario: The scenario.
        joints: The joints of the scenario.
        chains: The arm with its virtual joints.
    """
    robot = chains.arm_with_freedoms
    if robot is chains.arm:
        return joints
    count = robot.dof - chains.arm.dof
    return replace(
        joints,
        joint_names=robot.joint_names,
        joint_units=robot.joint_units,
        limits=robot.limits,
        robot=robot,
        targets=tuple(
            None
            if target is None
            else JointState(*(pad_virtual(values, count) for values in target))
            for target in joints.targets
        ),
        near=None if joints.near is None else pad_virtual(joints.near, count),
        near_at_waypoints=_with_virtual_positions(scenario, joints.near_at_waypoints, chains),
        chosen_sections=None,
    )


def _virtual_joints(freedom: PoseFreedom) -> list[VirtualJoint]:
    """Joints from the tool to the pose, opposite to the freedom; slides are along its axes."""
    joints, axes = [], None
    turned: list[tuple[str, str, tuple[float, float]]] = []
    if freedom.torch is not None:
        axes = _torch_axes(freedom.torch)
        turned = [
            ("travel angle", "y", freedom.torch.travel),
            ("work angle", "x", freedom.torch.work),
        ]
    elif freedom.tilt:
        # two turns within this bound keep the axis within the cone: cos²(t/√2) >= cos t
        limit = freedom.tilt / np.sqrt(2.0)
        joints += [VirtualJoint(f"free tilt {k}", k, -limit, limit) for k in "xy"]
    lower, upper = freedom.turn
    if lower < upper:
        joints.append(VirtualJoint("free turn", "z", -upper, -lower, slows_at_limits=False))
    for name, axis, (low, high) in turned:
        if low < high:
            joints.append(
                VirtualJoint(
                    name, axis, TORCH_RANGE_SHARE * low, TORCH_RANGE_SHARE * high, axes=axes
                )
            )
    for k, (low, high) in zip("xyz", freedom.box, strict=True):
        if low < high:
            joints.append(VirtualJoint(f"free position {k}", k, -high, -low, "m"))
    return joints


def _kind(joint: VirtualJoint) -> tuple[str, str, bytes]:
    """Key of a virtual joint; freedoms share joints of equal keys."""
    axes = b"" if joint.axes is None else np.asarray(joint.axes).tobytes()
    return joint.name, joint.axis, axes


def _merge_joints(joints: list[VirtualJoint]) -> dict[tuple[str, str, bytes], VirtualJoint]:
    """The distinct virtual joints of all freedoms, each with the union of its ranges."""
    shared: dict[tuple[str, str, bytes], VirtualJoint] = {}
    for joint in joints:
        merged = shared.setdefault(_kind(joint), joint)
        if merged is not joint:
            lower, upper = min(merged.lower, joint.lower), max(merged.upper, joint.upper)
            shared[_kind(joint)] = replace(merged, lower=lower, upper=upper)
    return shared


def _torch_axes(torch: TorchRanges) -> FloatArray:
    """Axes about which a torch's angles turn, relative to the TCP: see `TorchRanges`."""
    turns = np.array([[0.0, 0.0, torch.axis_angle], [0.0, torch.pose_travel, 0.0]])
    turned, leant = rotation_matrices(turns)
    return np.asarray(turned @ np.diag([1.0, -1.0, -1.0]) @ leant)


def pad_virtual(values: FloatArray, count: int) -> FloatArray:
    """Append zeros for virtual joints to joint values (..., d), shape (..., d + count)."""
    return np.concatenate((values, np.zeros((*values.shape[:-1], count))), axis=-1)


def _with_virtual_positions(
    scenario: Scenario, preferred: Mapping[int, FloatArray], chains: FreedomChains
) -> dict[int, FloatArray]:
    """Preferred joint positions at waypoints, with the virtual joints that reach each pose."""
    result = {}
    for i, q in preferred.items():
        waypoint, chain = scenario.waypoints[i], chains.for_waypoint(scenario.waypoints[i])
        result[i] = pad_virtual(q, chain.size - len(q))
        if isinstance(waypoint, CartesianWaypoint) and waypoint.freedom is not None:
            tool = chain.robot.forward(result[i][chain.columns])
            error = _pose_error(tool, waypoint.pose, waypoint.freedom.torch)
            virtual = chain.columns[chain.robot.is_virtual]
            result[i][virtual] = [
                error[joint.unit, joint.axis] for joint in chain.robot.virtual_joints
            ]
    return result


def _pose_error(
    tool: pin.SE3, pose: pin.SE3, torch: TorchRanges | None
) -> dict[tuple[str, str], float]:
    """Rotations about x, y, z in this order [rad] and translations [m] from the tool to the pose.

    Rotations of a torch are about z and then about y and x of its own axes.
    """
    R = tool.rotation.T @ pose.rotation
    x, y = np.arctan2(-R[1, 2], R[2, 2]), np.arctan2(R[0, 2], np.hypot(R[0, 0], R[0, 1]))
    turns = x, y, np.arctan2(-R[0, 1], R[0, 0])
    if torch is not None:
        M = _torch_axes(torch._replace(pose_travel=0.0)).T @ R @ _torch_axes(torch)
        y = np.arctan2(-M[2, 0], np.hypot(M[0, 0], M[1, 0])) - torch.pose_travel
        turns = np.arctan2(M[2, 1], M[2, 2]), y, np.arctan2(-M[1, 0], M[0, 0])
    slides = pose.rotation.T @ (pose.translation - tool.translation)
    return {("rad", k): float(v) for k, v in zip("xyz", turns, strict=True)} | {
        ("m", k): float(v) for k, v in zip("xyz", slides, strict=True)
    }
