"""Tool poses and speeds in, a verified C² joint trajectory out.

    import knotwork as kw

    plan = kw.plan("ur5_deburring")
    plan.report.raise_if_failed()
    plan.trajectory.velocity(1.2)  # joint velocities at 1.2 s [rad/s]
    plan.save("out")

Everything is loaded when it is first used, so that importing `knotwork` costs next to nothing.
"""

import lazy_loader

from knotwork.errors.old_names import with_old_names

__version__ = "2.0.0.dev0"

_load, __dir__, _offered = lazy_loader.attach_stub(__name__, __file__)
_PACKAGES = {
    "export",
    "interpolation",
    "kinematics",
    "recording",
    "sweeps",
    "task",
    "timing",
    "tool_paths",
    "verification",
    "view",
}
"""Packages that are attributes of `knotwork`, too, but are left out of `__all__`."""
__all__ = [name for name in _offered if name not in _PACKAGES]

_RENAMED = {
    "BalancedKnots": "knotwork.curves.interpolation.BalancedKnots",
    "CartesianWaypoint": "knotwork.waypoints.CartesianWaypoint",
    "Comparison": "knotwork.planning.comparison.Comparison",
    "PLANNERS": "knotwork.curves.interpolation.PLANNERS",
    "Payload": "knotwork.robot.payload.Payload",
    "PlannerOptions": "knotwork.curves.interpolation.PlannerOptions",
    "SweepProgress": "knotwork.planning.sweeps.SweepProgress",
    "follow": "knotwork.follow_path",
    "get_planner": "knotwork.curves.interpolation.get_planner",
    "solve_all": "knotwork.solve_pose_ik_all",
    "solve_many": "knotwork.robot.kinematics.solve_pose_ik_batch",
}
"""Old names, which work for one version, and the full new ones."""

__getattr__ = with_old_names(_load, __name__, _RENAMED)
