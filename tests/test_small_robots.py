"""Robots at the edge of what is one: a single joint, no tool frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import knotwork as kw

URDF = """<robot name="lever">
  <link name="stand"/>
  <link name="arm"><inertial><mass value="2"/><origin xyz="0.5 0 0"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="turn" type="revolute"><parent link="stand"/><child link="arm"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="5" velocity="2"/></joint>
</robot>
"""


@pytest.fixture
def lever(tmp_path: Path) -> Path:
    path = tmp_path / "lever.urdf"
    path.write_text(URDF)
    return path


def test_an_arm_of_one_joint_meets_poses_and_speeds(lever: Path) -> None:
    def pose(angle: float) -> dict[str, list[float]]:
        return {
            "position": [0.8 * np.cos(angle), 0.8 * np.sin(angle), 0.0],
            "rpy": [0.0, 0.0, angle],
        }

    plan = kw.plan(
        {
            "robot": str(lever),
            "tool": {"frame": "arm", "offset": {"position": [0.8, 0, 0]}},
            "waypoints": [
                {"pose": pose(0.0)},
                {
                    "pose": pose(0.3),
                    "after": 1,
                    "velocity": {"linear": [0, 0.16, 0], "angular": [0, 0, 0.2], "in": "tool"},
                },
                {"pose": pose(0.7), "after": 1},
            ],
        }
    )
    plan.report.raise_if_failed()
    np.testing.assert_allclose(plan.joint_waypoints.position[:, 0], [0, 0.3, 0.7], atol=1e-9)
    np.testing.assert_allclose(plan.joint_waypoints.velocity[:, 0], [0, 0.2, 0], atol=1e-9)
    (found,) = plan.report.select(group="Singularity")
    # J = (0, 0.8, 0, 0, 0, 1): its one singular value is sqrt(1 + 0.8²)
    assert found.value == pytest.approx(np.hypot(1, 0.8))
