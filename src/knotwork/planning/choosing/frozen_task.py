"""Tasks with chosen values in place of unknowns, and the text of their files."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import InputError
from knotwork.files.documents import read, read_text, with_values
from knotwork.files.documents.edits import differences
from knotwork.files.documents.yaml_text import to_block_yaml
from knotwork.planning.choosing.solved_scenario import SolvedScenario
from knotwork.planning.choosing.timing_sections import TimingSection
from knotwork.planning.timing import TimedMotion
from knotwork.task import ChosenSectionFields, Task, Velocity
from knotwork.task.scenario import JointTarget, Scenario
from knotwork.task.scenario.resolve import change_task
from knotwork.task.scenario.scenario_joints import to_file_units
from knotwork.task.task_source import with_moved_paths
from knotwork.waypoints import CartesianWaypoint

CHOSEN_STOP_SPEED = 1e-9
"""Chosen speeds below this are stops [m/s]."""


def with_chosen_values(
    solved: SolvedScenario, motions: Mapping[TimingSection, TimedMotion]
) -> Scenario:
    """The scenario with numbers in place of its unknowns, from the motions of all sections."""
    scenario, waypoint_unknowns = solved.scenario, solved.unknowns.at_waypoints
    waypoints: defaultdict[int, dict[str, Any]] = defaultdict(dict)
    positions = np.array(solved.joint_waypoints.position)
    for section, motion in motions.items():
        if section.way is not None:  # its end was chosen
            positions[section.rows] = motion.trajectory.position(motion.time)
    waypoints.update(solutions_near(solved, positions))
    for i, waypoint in enumerate(waypoint_unknowns):
        if waypoint.way is not None:
            waypoints[scenario.task_index[i]]["way"] = None
    for section, motion in motions.items():
        for k, i in enumerate(section.indices):
            changes = waypoints[scenario.task_index[i]]
            if k and waypoint_unknowns[i].duration_is_unknown:
                after = float(motion.time[k] - motion.time[k - 1])
                changes |= {"time": None, "after": after}
            q = positions[section.rows[k]]
            changes |= _chosen_speed(solved, i, q, motion.velocity[k])
    optimal = scenario.task.knots == "optimal"
    numbers = scenario.task.with_waypoints(waypoints).replace(
        times=None, duration=None, objective=None, ways=None, **({"knots": None} if optimal else {})
    )
    timed = change_task(scenario, numbers)
    if not motions:
        return timed
    sections = [_chosen_section(timed, *pair) for pair in motions.items()]
    return replace(timed, task=numbers.replace(chosen=sections))


def solutions_near(
    solved: SolvedScenario, positions: FloatArray | None = None
) -> dict[int, dict[str, Any]]:
    """Keys `near` of the waypoints, with which planning chooses the same IK solutions again.

    Args:
        solved: The scenario and its IK solutions.
        positions: Joint positions of all rows [rad or m], by default those of its solution.
    """
    positions = solved.joint_waypoints.position if positions is None else positions
    index, paths = solved.scenario.task_index, solved.scenario.paths
    units = solved.scenario.task.units
    # In the task, the end of a path and the end of the wait there are one waypoint. A wait on a
    # moving frame is a path as well. A pose without another path to it has its own solution.
    along = ((path.first, i) for path in paths for i in range(path.first + 1, path.last + 1))
    followed = {index[i] for first, i in along if index[i] != index[first]}
    poses: dict[int, int] = {}
    for i, waypoint in enumerate(solved.scenario.waypoints):
        if isinstance(waypoint, CartesianWaypoint) and index[i] not in followed:
            poses.setdefault(index[i], i)
    return {
        task_i: {"near": to_file_units(solved.joints, positions[solved.rows[i]], units)}
        for task_i, i in poses.items()
    }


def _chosen_speed(solved: SolvedScenario, i: int, q: FloatArray, v: FloatArray) -> dict[str, Any]:
    """Keys for the speed or velocity of a waypoint where it is chosen."""
    kind, robot = solved.unknowns.at_waypoints[i].velocity_kind, solved.joints.robot
    waypoint = solved.scenario.waypoints[i]
    units = solved.scenario.task.units
    length, angle = units.in_si
    if kind == "given":
        return {}
    if robot is None or isinstance(waypoint, JointTarget):
        return {"velocity": to_file_units(solved.joints, v, units)}
    robot, columns = robot.robot_and_columns(in_world_frame=waypoint.in_world_frame)
    twist = robot.twist(q[columns], v[columns])
    if kind == "unknown":
        twist -= waypoint.twist  # the file gives relative velocities
        scenario = solved.scenario
        axes = "base"
        turn = np.eye(3)
        if scenario.pose_frame_link and not waypoint.in_world_frame:
            # the base of the file moves relative to it
            axes = scenario.task.frame_of(scenario.task.waypoints[scenario.task_index[i]])
            turn = scenario.frame_placements[axes].rotation.T
        linear, angular = turn @ twist.linear / length, turn @ twist.angular / angle
        return {"velocity": Velocity(linear=linear, angular=angular, axes=axes)}
    speed = float(np.linalg.norm(twist.linear))
    return {"speed": None, "stop": True} if speed < CHOSEN_STOP_SPEED else {"speed": speed / length}


def _chosen_section(
    timed: Scenario, section: TimingSection, motion: TimedMotion
) -> ChosenSectionFields:
    """Knots and velocities of a section, with which the task defines its motion.

    Args:
        timed: The scenario with numbers in place of unknowns.
        section: A section.
        motion: Its motion.
    """
    units, joints = timed.task.units, section.solved.joints
    x = motion.trajectory.breaks
    times = np.interp(x, motion.time, timed.times[section.indices])
    velocities = {
        timed.waypoints[i].name: to_file_units(joints, motion.velocity[k], units)
        for k, i in enumerate(section.indices)
        if section.waypoint_unknowns[k].velocity_kind != "given"
    }
    extra: dict[str, Any] = {"velocities": velocities, "tries": motion.tries}
    if motion.extra_clearance is not None:
        extra["extra_clearance"] = motion.extra_clearance / units.in_si[0]
    return ChosenSectionFields(
        times=times.tolist(),
        accelerations=to_file_units(joints, motion.trajectory.acceleration(x), units),
        **{key: value for key, value in extra.items() if value},
    )


def frozen_text(scenario: Scenario, folder: Path) -> str:
    """YAML of a task that keeps the comments of its file, if there is one.

    Args:
        scenario: The scenario.
        folder: Folder of the new file, for relative paths.

    Raises:
        InputError: The file can't be read any more, or the values can't be written into its text.
    """
    content = _task_data(scenario, folder)
    if scenario.source is None:
        return to_block_yaml(content)
    file = read(scenario.source)
    return with_values(read_text(scenario.source), differences(file.data, content))


def saved_text(scenario: Scenario, folder: Path) -> str:
    """YAML of a task, without the comments of its file if these can't be kept."""
    try:
        return frozen_text(scenario, folder)
    except InputError as error:
        why = str(error).replace("\n", " ")
        text = to_block_yaml(_task_data(scenario, folder))
        return f"# Written anew, without the comments of the original file: {why}\n{text}"


def _task_data(scenario: Scenario, folder: Path) -> dict[str, object]:
    source = Path.cwd() if scenario.source is None else scenario.source.parent
    data: dict[str, object] = with_moved_paths(
        Task, scenario.task.to_dict(), source, folder.resolve()
    )
    return data
