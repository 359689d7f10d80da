"""Robots: a Pinocchio model, the tool it carries, its limits and its named configurations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.robot.load import load_robot as load_robot
    from knotwork.robot.load import robot_names as robot_names
    from knotwork.robot.model import Robot as Robot

# Looked up when first used, so that the schema of a robot file can be had without Pinocchio.
__getattr__, __dir__, __all__ = lazy_names(__name__)
