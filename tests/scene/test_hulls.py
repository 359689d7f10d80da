"""Convex hulls of meshes: read anew when a file has changed, and refused where Coal can't."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh

import knotwork as kw
from knotwork.errors import InputError
from knotwork.scenario import Shape
from knotwork.scene.building import robot_collision_model
from knotwork.scene.solids import solid

URDF = (
    '<robot name="r"><link name="a"/><link name="b"><collision><geometry>'
    '<mesh filename="part.stl"/></geometry></collision></link><joint name="j" type="revolute">'
    '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
    '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
)


def test_a_mesh_of_a_robot_that_has_changed_is_read_anew(tmp_path: Path) -> None:
    """A file that changes, goes or comes, in one process and with one robot."""
    (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
    robot, mesh = kw.load_robot(tmp_path / "arm.urdf").with_tool("b"), tmp_path / "part.stl"
    for edge in (None, 1.0, 2.0, None, 3.0):
        if edge is None:
            mesh.unlink(missing_ok=True)
        else:
            mesh.write_bytes(trimesh.creation.box([edge] * 3).export(file_type="stl"))
        model = robot_collision_model(robot)
        if edge is None:
            assert not model.bodies
        else:
            ((solid,),) = (body.solids for body in model.bodies)
            np.testing.assert_allclose(np.ptp(solid.corners, axis=0), edge)


def test_a_cone_of_many_sides_is_refused_with_what_would_do(tmp_path: Path) -> None:
    path = tmp_path / "cone.stl"
    trimesh.creation.cone(1.0, 1.0, sections=600).export(path)
    place = pin.SE3.Identity()
    with pytest.raises(InputError, match="more than 254 corners around it; give a coarser mesh"):
        solid(Shape("mesh", (), place, path), place)
