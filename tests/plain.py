"""Where tools are by plain Pinocchio, of a model that is read from the URDF by itself."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

import knotwork as kw


def full_configuration(model: pin.Model, robot: kw.Robot, q: np.ndarray) -> np.ndarray:
    """Pinocchio's own configuration: cosine and sine for the joints that turn without limit."""
    full = pin.neutral(model)
    positions = {**robot.locked, **dict(zip(robot.joint_names, q, strict=True))}
    for name, value in positions.items():
        joint = model.joints[model.getJointId(name)]
        entry = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
        full[joint.idx_q : joint.idx_q + joint.nq] = entry
    return full


def tool_frames(robot: kw.Robot, q: np.ndarray | list[np.ndarray]) -> list[pin.SE3]:
    """Poses of the tool frame in the base frame, one a row of joint values."""
    model = pin.buildModelFromUrdf(str(robot.urdf))
    data = model.createData()
    base, tool = (model.getFrameId(f, pin.BODY) for f in (robot.base_frame, robot.tool_frame))
    found = []
    for row in q:
        pin.framesForwardKinematics(model, data, full_configuration(model, robot, row))
        found.append(data.oMf[base].inverse() * data.oMf[tool])
    return found


def tool_poses(plan: kw.Plan, times: np.ndarray | list[float]) -> list[pin.SE3]:
    return tool_frames(plan.joints.robot, plan.trajectory.position(times))
