"""Robots: a Pinocchio model, the tool it carries, its limits and its named configurations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.robot.load import load_robot, robot_names
    from knotwork.robot.model import Robot

__all__ = ["Robot", "load_robot", "robot_names"]

# Looked up when first used, so that the schema of a robot file can be had without Pinocchio.
__getattr__, __dir__ = lazy_names(
    __name__, {"model": ("Robot",), "load": ("load_robot", "robot_names")}
)
