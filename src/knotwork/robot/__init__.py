"""Robots: a Pinocchio model, the tool it carries, its limits and its named configurations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from knotwork.robot.load import load_robot, robot_names
    from knotwork.robot.model import Robot

__all__ = ["Robot", "load_robot", "robot_names"]

# Looked up when first used, so that the schema of a robot file can be had without Pinocchio.
_HOMES = {"Robot": "model", "load_robot": "load", "robot_names": "load"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
