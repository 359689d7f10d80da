"""Placements and velocities of many configurations at once, against Pinocchio's, one by one."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.joint_tree import joint_tree, place_joints


@pytest.mark.parametrize("arm", ["planar2", "ur5", "panda", "kinova", "xarm7"])
def test_joints_and_tool_move_as_in_pinocchio(arm: str) -> None:
    robot, generator = kw.load_robot(arm), np.random.default_rng(1)
    model, data = robot.model, robot.model.createData()
    q = generator.uniform(-3, 3, (20, model.nv))
    rotations, origins = place_joints(joint_tree(model), q)
    tip, columns, J = joint_axes(robot).compute_poses_and_jacobians(q)
    for k, one in enumerate(q):
        pin.forwardKinematics(model, data, one)
        for i in range(1, model.njoints):
            np.testing.assert_allclose(rotations[k, i], data.oMi[i].rotation, atol=1e-12)
            np.testing.assert_allclose(origins[k, i], data.oMi[i].translation, atol=1e-12)
        pose, jacobian = robot.forward_and_jacobian(one)
        np.testing.assert_allclose(tip[:, k], pose.translation, atol=1e-12)
        np.testing.assert_allclose(columns[:, :, k].T, pose.rotation, atol=1e-12)
        np.testing.assert_allclose(J[:, :, k], jacobian, atol=1e-12)
