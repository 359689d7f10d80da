"""Schema of a robot description: a file `robots/*.yaml`, or the same keys inside a scenario."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from knotwork.files.documents import Number, StrictModel, Text
from knotwork.files.documents.values import JointLimitFields, optional, required
from knotwork.robot.external_axes import ExternalAxis


class CollisionFields(StrictModel):
    """Pairs of links that are not checked, by their names or from an SRDF."""

    ignore: list[Annotated[list[Text], Field(min_length=2, max_length=2)]] = optional(
        "Names of the two links of each pair", []
    )
    srdf: Text | None = optional(
        "Path of an SRDF, given as that of the URDF; its disabled pairs are not checked"
    )


class RobotFile(StrictModel):
    """A robot: its URDF, the chain of the arm, and data missing in the URDF, in SI units."""

    name: Text | None = optional("Name of the robot; left out: that of the file")
    description: str = optional("Description in one sentence", "")
    urdf: Text = required(
        "Path relative to the file, or in an installed Python package, as in "
        "`airo_models:arms/ur5e/ur5e.urdf`; `example-robot-data:` is its folder `robots`"
    )
    package_paths: list[Text] = optional(
        "Additional folders with meshes, relative to the file or as for `urdf`: "
        "packages of `package://NAME/…`, whatever the folder's name is, folders of packages, or "
        "the base of relative paths",
        [],
    )
    external_axes: dict[Text, ExternalAxis] = optional(
        "Joints and positioners added to the URDF, by name; its root is then the link `cell`", {}
    )
    base_frame: Text | None = optional("Link of the frame of poses; left out: the root of the URDF")
    tool_frame: Text | None = optional("Link that carries the TCP; left out: the scenario names it")
    locked: dict[str, Number] = optional(
        "Joints that do not move, for example fingers, and their positions [rad or m]", {}
    )
    configurations: dict[str, dict[str, Number]] = optional(
        "Named configurations: joint to position [rad or m]", {}
    )
    collision: CollisionFields = optional(
        "Pairs of links that are never checked for collisions", CollisionFields.model_construct()
    )
    limits: JointLimitFields = optional(
        "Limits that are missing in the URDF or override it", JointLimitFields.model_construct()
    )
