"""Robots: a Pinocchio model, the tool it carries, its limits and its named configurations."""

from knotwork.robot.load import load_robot, robot_names
from knotwork.robot.model import Robot

__all__ = ["Robot", "load_robot", "robot_names"]
