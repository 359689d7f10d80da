"""Pages of plans and stored trajectories."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from knotwork.robot import Robot
from knotwork.spline.trajectory import JointTrajectory
from knotwork.view.page import Page, scene_page
from knotwork.view.scene_data import make_scene, scene_of
from knotwork.view.shown_motion import PlanLike, ShownMotion


def view_plan(
    plan: PlanLike,
    others: Mapping[str, JointTrajectory] | None = None,
    *,
    ghosts: bool = True,
    autoplay: bool = True,
    embedded: bool = False,
) -> Page:
    """Show a plan: the moving arm, the task, and failures of the check.

    Args:
        plan: The plan.
        others: Trajectories of other planners by name, shown as translucent arms over it.
        ghosts: Show translucent copies of the arm at the waypoints at first.
        autoplay: Start the motion automatically.
        embedded: The page is part of another, which has the title and the verdict.

    Raises:
        InputError: The scenario has no robot, or the motion can't be shown.
    """
    scene = scene_of(plan, others)
    return scene_page(scene, embedded=embedded, autoplay=autoplay, ghosts=ghosts)


def view_trajectory(robot: Robot, trajectory: JointTrajectory, *, ghosts: bool = True) -> Page:
    """Show a stored trajectory without its task.

    >>> motion = kw.plan("planar2_closed_form").trajectory
    >>> view_trajectory(kw.load_robot("planar2"), motion).save("arm.html").name
    'arm.html'

    Args:
        robot: Its arm.
        trajectory: The motion.
        ghosts: Show translucent copies of the arm at the waypoints at first.

    Raises:
        InputError: The trajectory has other joints than the robot, or can't be shown.
    """
    return scene_page(scene_of_trajectory(robot, trajectory), ghosts=ghosts)


def scene_of_trajectory(
    robot: Robot, trajectory: JointTrajectory, before: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Compose the scene of a stored trajectory, as plain data; `before` as for `make_scene`.

    Raises:
        InputError: The trajectory has other joints than the robot, or can't be shown.
    """
    return make_scene(
        ShownMotion.of_robot(robot, trajectory), warnings=_tool_warnings(robot), before=before
    )


def _tool_warnings(robot: Robot) -> list[str]:
    """Warn that a trajectory without a scenario does not name its tool."""
    if robot.tcp_frame_id is None:
        return [
            f"robot {robot.name!r} names no tool frame, so no path of a tool is shown; give the "
            "scenario that the trajectory was planned for, or a robot with a tool frame"
        ]
    if robot.tool_offset.isIdentity(1e-9):
        return [
            "a trajectory does not name its tool: the path and the speed "
            f"shown are those of the robot's frame {robot.tool_frame!r}; give its scenario "
            "to see those of its tool"
        ]
    return []
