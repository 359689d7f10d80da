"""Old names, which still work for one version, with a warning that names the new one."""

from __future__ import annotations

import importlib
import importlib.abc
import importlib.util
import sys
import warnings
from collections.abc import Callable
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

RENAMED = {
    "knotwork.BalancedKnots": "knotwork.spline.interpolation.BalancedKnots",
    "knotwork.CartesianWaypoint": "knotwork.waypoints.CartesianWaypoint",
    "knotwork.Comparison": "knotwork.planning.comparison.Comparison",
    "knotwork.PLANNERS": "knotwork.spline.interpolation.PLANNERS",
    "knotwork.Payload": "knotwork.robot.payload.Payload",
    "knotwork.PlannerOptions": "knotwork.spline.interpolation.PlannerOptions",
    "knotwork.SweepProgress": "knotwork.sweeps.SweepProgress",
    "knotwork.follow": "knotwork.follow_path",
    "knotwork.get_planner": "knotwork.spline.interpolation.get_planner",
    "knotwork.solve_all": "knotwork.solve_pose_ik_all",
    "knotwork.solve_many": "knotwork.kinematics.solve_pose_ik_batch",
    "knotwork.kinematics.solve_all": "knotwork.kinematics.solve_pose_ik_all",
    "knotwork.kinematics.solve_many": "knotwork.kinematics.solve_pose_ik_batch",
    "knotwork.Robot.solve_all": "knotwork.Robot.solve_pose_ik_all",
    "knotwork.spline.trajectory.Event.said": "knotwork.spline.trajectory.Event.text",
    "knotwork.spline.trajectory.Segment.said": "knotwork.spline.trajectory.Segment.text",
}
"""Full old name to full new name."""

MOVED = {
    f"knotwork.{package}": f"knotwork.{room}.{package}"
    for room, packages in {
        "spline": ("polynomial", "trajectory", "interpolation"),
        "files": ("storage", "foreign"),
        "verification": ("metrics", "recording"),
        "planning": ("timing", "task_to_joint", "comparison"),
    }.items()
    for package in packages
} | {"knotwork.pipeline": "knotwork.planning"}
"""Packages that can be imported by their old names, too: old to new."""


class MovedPackages(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Importer of packages by the names in `MOVED`, with a warning."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Give a spec of this loader for an old name."""
        return importlib.util.spec_from_loader(name, self) if name in MOVED else None

    def exec_module(self, module: ModuleType) -> None:
        """Put the package of the new name in the place of the old one."""
        old = module.__name__
        warnings.warn(_text(old, MOVED[old]), DeprecationWarning, stacklevel=2)
        sys.modules[old] = importlib.import_module(MOVED[old])


sys.meta_path.append(MovedPackages())


def with_old_names(package: str, load: Callable[[str], Any]) -> Callable[[str], Any]:
    """Make a `__getattr__` that also finds the old names of a package.

    Args:
        package: Full name of the package.
        load: Its `__getattr__` for all other names.
    """

    def find(name: str) -> Any:
        old = f"{package}.{name}"
        if old not in RENAMED:
            try:
                return load(name)
            except AttributeError:
                if old not in MOVED:
                    raise
            return importlib.import_module(old)
        home, _, last = _new_name(old).rpartition(".")
        return getattr(importlib.import_module(home), last)

    return find


def old_method(name: str) -> Callable[..., Any]:
    """Make the method of an old name, which calls its replacement."""

    def call(self: object, *arguments: Any, **options: Any) -> Any:
        return getattr(self, _new_name(name).rpartition(".")[2])(*arguments, **options)

    return call


def old_property(name: str) -> property:
    """Make the property of an old name, which gives the one that replaces it."""
    return property(lambda self: getattr(self, _new_name(name).rpartition(".")[2]))


def _new_name(old: str) -> str:
    """The new name, with a warning to the caller's caller."""
    warnings.warn(_text(old, RENAMED[old]), DeprecationWarning, stacklevel=3)
    return RENAMED[old]


def _text(old: str, new: str) -> str:
    return f"{old} is now {new}; the old name goes with the next version"
