"""Placements and velocities of many configurations at once, against Pinocchio's, one by one."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.robot.joint_tree import frame_motion, joint_tree


@pytest.mark.parametrize("arm", ["planar2", "ur5", "panda", "kinova", "xarm7"])
def test_a_frame_moves_as_pinocchio_says(arm: str) -> None:
    rng = np.random.default_rng(1)
    robot = kw.load_robot(arm)
    model, data = robot.model, robot.model.createData()
    q, v = rng.uniform(-3, 3, (2, 20, model.nv))
    for index in range(1, model.nframes):
        frame = model.frames[index]
        found = frame_motion(joint_tree(model), frame, q, v)
        for k, (position, rotation, velocity) in enumerate(zip(*found, strict=True)):
            pin.forwardKinematics(model, data, q[k], v[k])
            placed = pin.updateFramePlacement(model, data, index)
            twist = pin.getFrameVelocity(model, data, index, pin.LOCAL_WORLD_ALIGNED)
            np.testing.assert_allclose(position, placed.translation, atol=1e-12)
            np.testing.assert_allclose(rotation, placed.rotation, atol=1e-12)
            np.testing.assert_allclose(velocity, twist.linear, atol=1e-11)
