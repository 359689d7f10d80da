"""Old names, which still work for one version, with a warning that names the new one."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable
from typing import Any

RENAMED = {
    "knotwork.BalancedKnots": "knotwork.interpolation.BalancedKnots",
    "knotwork.CartesianWaypoint": "knotwork.waypoints.CartesianWaypoint",
    "knotwork.Comparison": "knotwork.comparison.Comparison",
    "knotwork.PLANNERS": "knotwork.interpolation.PLANNERS",
    "knotwork.Payload": "knotwork.robot.payload.Payload",
    "knotwork.PlannerOptions": "knotwork.interpolation.PlannerOptions",
    "knotwork.SweepProgress": "knotwork.sweeps.SweepProgress",
    "knotwork.follow": "knotwork.follow_path",
    "knotwork.get_planner": "knotwork.interpolation.get_planner",
    "knotwork.solve_all": "knotwork.solve_pose_ik_all",
    "knotwork.solve_many": "knotwork.kinematics.solve_pose_ik_batch",
    "knotwork.kinematics.solve_all": "knotwork.kinematics.solve_pose_ik_all",
    "knotwork.kinematics.solve_many": "knotwork.kinematics.solve_pose_ik_batch",
    "knotwork.Robot.solve_all": "knotwork.Robot.solve_pose_ik_all",
}
"""Full old name to full new name."""


def with_old_names(package: str, load: Callable[[str], Any]) -> Callable[[str], Any]:
    """Make a `__getattr__` that also finds the old names of a package.

    Args:
        package: Full name of the package.
        load: Its `__getattr__` for all other names.
    """

    def find(name: str) -> Any:
        if f"{package}.{name}" not in RENAMED:
            return load(name)
        home, _, last = _new_name(f"{package}.{name}").rpartition(".")
        return getattr(importlib.import_module(home), last)

    return find


def old_method(name: str) -> Callable[..., Any]:
    """Make the method of an old name, which calls its replacement."""

    def call(self: object, *arguments: Any, **options: Any) -> Any:
        return getattr(self, _new_name(name).rpartition(".")[2])(*arguments, **options)

    return call


def _new_name(old: str) -> str:
    """The new name, with a warning to the caller's caller."""
    new = RENAMED[old]
    text = f"{old} is now {new}; the old name goes with the next version"
    warnings.warn(text, DeprecationWarning, stacklevel=3)
    return new
