"""Collision-free motions for sections with `way: clear`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.errors import InputError, NoWayFoundError
from knotwork.errors.plain_text import quoted_waypoint
from knotwork.planning.choosing.timing_sections import TimingSection
from knotwork.planning.clear_motions.clear_motion_problem import (
    ClearMotion,
    ClearMotionProblem,
    ClearSearchError,
)
from knotwork.planning.clear_motions.clear_search import find_clear_motion, slow_to_duration
from knotwork.planning.timing import TimedMotion, TimingProblem
from knotwork.planning.timing.budget import Budget
from knotwork.planning.timing.minimum_durations import lower_bound, sufficient_duration
from knotwork.planning.timing.timed_motion import TimedCurve
from knotwork.robot import Robot
from knotwork.scene.collision_model import CollisionModel
from knotwork.task import PoseWaypoint
from knotwork.units import rounded_up
from knotwork.waypoints import CartesianWaypoint

MAX_SOLUTIONS = 12
"""Maximum number of solutions of a pose at either end of a motion."""


def plan_clear_section(
    section: TimingSection,
    problem: TimingProblem,
    budget: Budget,
    start: FloatArray | None = None,
) -> TimedMotion:
    """Find a fast motion for a section, proved to be collision-free.

    Args:
        section: A section with `way: clear`.
        problem: Its timing problem.
        budget: Budget and progress of all sections.
        start: Joint positions at the end of the previous motion, shape (d,), or `None`.

    Raises:
        NoWayFoundError: No motion was found, or an end is not clear.
    """
    solved, options, robot = section.solved, section.way, section.solved.joints.robot
    if options is None or robot is None:
        raise TypeError("the section has no way: clear")
    if start is not None:
        problem = replace(problem, position=np.stack((start, *problem.position[1:])))
    clear_problem = ClearMotionProblem(
        problem,
        starts=_start_solutions(section, problem, robot),
        goals=_goal_solutions(section, problem, robot),
        arm_model=robot.model,
        collision_model=_bodies(section),
        resolution=solved.scenario.scene.collisions.resolution,
        continued=_continued_motion(section, problem.joint_names),
    )
    try:
        motion = find_clear_motion(
            clear_problem, budget, tries=options.tries, extra_clearance=options.extra_clearance
        )
    except ClearSearchError as error:
        single = len(clear_problem.starts) == len(clear_problem.goals) == 1
        raise _located_error(error, section, single=single) from None
    budget.count_solved(len(section.indices) - 1)
    curve = _slowed(motion, problem, section)
    time = motion.time * (float(curve.x[-1]) / motion.duration)
    slowed = TimedCurve(time, curve, "resting" if motion.rests else "optimal")
    timed = TimedMotion.of(problem, slowed, _lower_bound(clear_problem), "way")
    extra_clearance = motion.extra_clearance if options.extra_clearance else None
    return replace(timed, line=motion.line, tries=motion.tries, extra_clearance=extra_clearance)


def _lower_bound(clear_problem: ClearMotionProblem) -> float:
    """Lower bound on the duration between any two solutions of the ends [s]."""
    timing = clear_problem.timing
    return min(
        lower_bound(replace(timing, position=np.stack((start, *timing.position[1:-1], goal))))
        for start in clear_problem.starts
        for goal in clear_problem.goals
    )


def _continued_motion(
    section: TimingSection, joint_names: Sequence[str]
) -> tuple[PiecewisePolynomial, float] | None:
    """The motion that the task continues, and the start of the section in it [s], or `None`."""
    continued = section.solved.scenario.continued_motion
    if continued is None or section.indices[0]:
        return None
    motion, at = continued
    columns = [motion.joint_names.index(name) for name in joint_names]
    return PiecewisePolynomial(motion.polynomial.c[:, :, columns], motion.polynomial.x), at


def _bodies(section: TimingSection) -> CollisionModel:
    """Bodies that are present during a section. They must not change.

    Raises:
        InputError: The bodies change during the section, or an obstacle moves.
    """
    solved = section.solved
    first, *later = (solved.bodies_in_interval(i) for i in section.indices[:-1])
    for model, i in zip(later, section.indices[1:-1], strict=True):
        if model.pairs != first.pairs:
            raise InputError(
                "the velocity is chosen, but a body comes or goes here; accepted: stop, or a "
                "velocity",
                where=solved.where(i),
            )
    joint_count = solved.joints.robot.model.njoints if solved.joints.robot is not None else 0
    bodies = (first.bodies[k] for pair in first.pairs for k in (pair.first, pair.second))
    moving = (body.name.split("/")[0] for body in bodies if body.joint >= joint_count)
    if obstacles := dict.fromkeys(moving):
        raise InputError(
            f"does not support moving obstacles ({', '.join(obstacles)}); "
            "accepted: no way here, and waypoints around them with times or after: fastest",
            where=solved.where(section.indices[-1], "way"),
        )
    return first


def _start_solutions(section: TimingSection, problem: TimingProblem, robot: Robot) -> FloatArray:
    """Joint positions at the start: all solutions of its pose, if no motion precedes it."""
    if section.indices[0] > 0:
        return problem.position[:1]
    return _independent_solutions(section, problem, robot, 0, problem.position[-1])


def _goal_solutions(section: TimingSection, problem: TimingProblem, robot: Robot) -> FloatArray:
    """Joint positions at the end: all solutions of its pose, if no given motion follows.

    A following motion that is planned collision-free may begin with any of them.
    """
    i = section.indices[-1]
    if any(at.way is None for at in section.solved.unknowns.at_waypoints[i + 1 : i + 2]):
        return problem.position[-1:]
    return _independent_solutions(section, problem, robot, -1, problem.position[0])


def _independent_solutions(
    section: TimingSection, problem: TimingProblem, robot: Robot, end: int, other_end: FloatArray
) -> FloatArray:
    """Solutions of the pose at an end with no dependent motion beyond it, shape (m, d).

    All of them, in order of the distance to the other end, if the arm stops there and the task
    leaves the choice to planning; otherwise the chosen one.

    Args:
        section: The section.
        problem: Its timing problem.
        robot: The arm.
        end: Index of the end in the section, 0 or -1.
        other_end: Joint positions at the other end, shape (d,).
    """
    scenario, i = section.solved.scenario, section.indices[end]
    chosen, waypoint = problem.position[end], scenario.waypoints[i]
    task_waypoint = scenario.task.waypoints[scenario.task_index[i]]
    if (
        not isinstance(waypoint, CartesianWaypoint)
        or not isinstance(task_waypoint, PoseWaypoint)
        or task_waypoint.near is not None
        or scenario.task.near is not None
        or scenario.branch != "free"
        or problem.velocity[end].any()
        or waypoint.in_world_frame
    ):
        return np.array([chosen])
    turns = [q for solution in robot.solve_pose_ik_all(waypoint.pose) for q in solution.turns]
    solutions = np.array([chosen, *turns])
    far = (np.abs(solutions - other_end) / problem.limits.velocity).max(axis=1)
    order = np.argsort(far, kind="stable")[:MAX_SOLUTIONS]
    return np.concatenate((chosen[None], solutions[order[order > 0]]))


def _slowed(
    motion: ClearMotion, problem: TimingProblem, section: TimingSection
) -> PiecewisePolynomial:
    """A motion slowed down to the given time, if there is one."""
    given_time = float(problem.total or problem.duration.sum())
    least = float(problem.min_duration.sum())
    duration = max(motion.duration, least) if np.isnan(given_time) else given_time
    if duration == motion.duration:
        return motion.curve
    if duration < motion.duration:
        message = (
            f"{duration:g} s is shorter than the fastest motion found, which takes "
            f"{rounded_up(motion.duration):.6g} s; accepted: "
            f"{sufficient_duration(motion.duration):.6g} s or more, or no time"
        )
    elif (curve := slow_to_duration(motion, duration)) is not None:
        return curve
    else:
        message = (
            f"a motion of {duration:g} s is infeasible with the velocities at its ends; "
            "accepted: no time, or a stop at both ends"
        )
    raise InputError(message, where=section.solved.where(section.indices[-1]))


def _located_error(
    error: ClearSearchError, section: TimingSection, *, single: bool
) -> NoWayFoundError:
    """Make the error of a missing motion, at a colliding waypoint, or else at the goal.

    Args:
        error: The reason why there is no motion.
        section: The section without a motion.
        single: Whether only one solution of each end was a candidate.
    """
    solved = section.solved
    names = [quoted_waypoint(solved.scenario.waypoints[i].name) for i in section.indices]
    text = solved.scenario.units.text
    k = error.waypoint_index
    bodies: tuple[str, ...] = ()
    if k is None:
        reason = f" was found among {error.checks} configurations; one may exist all the same"
        accepted = "more space, a waypoint in between, or a smaller scene.margin"
    else:
        where = f"at {names[k]}"
        if error.moving or error.limit:
            phase = "stopping after" if k == 0 else "coming from rest to"
            where = f"{phase} {names[k]}"
        if error.limit:
            joints = solved.joints
            joint, unit = joints.joint_names[error.joint], joints.joint_units[error.joint]
            excess = f"exceeds its {error.limit} limit"
            if error.limit == "position":
                excess = f"goes {text(error.shortfall, unit, '.4g')} beyond its position limit"
            elif error.limit == "tool_speed":
                joint, excess = "the tool", "exceeds its speed limit"
            reason = f": {where}, {joint} {excess}"
            accepted = "a lower velocity there, or a stop"
        else:
            bodies = first, second = error.bodies
            shortfall = text(error.shortfall, "m", ".4g")
            reason = f": {where}, {second} is {shortfall} too close to {first}"
            if error.solutions > 1:
                reason += f", and none of {error.solutions} solutions is clear"
            slower = "a lower velocity or " if error.moving else ""
            accepted = f"{slower}another pose there, a smaller scene.margin, or objects elsewhere"
    return NoWayFoundError(
        f"no collision-free motion from {names[0]} to {names[-1]}{reason}; accepted: {accepted}",
        waypoint_index=None if k is None else section.indices[k],
        bodies=bodies,
        shortfall=error.shortfall,
        between=(section.indices[0], section.indices[-1]) if single else None,
        where=solved.where(section.indices[-1 if k is None else k]),
    )
