"""Collision-free motions of segments with `way: clear`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from knotwork.choosing.segments import Segment
from knotwork.choosing.task import FreeTask
from knotwork.errors import InputError, NoWayFoundError
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.refined import cut_curve
from knotwork.retiming import stop_on_path
from knotwork.robot import Robot
from knotwork.scene.collision_model import CollisionModel
from knotwork.task import PoseWaypoint
from knotwork.timing import TimedMotion, TimingProblem
from knotwork.timing.binding import binding_limits
from knotwork.timing.bounds import lower_bound
from knotwork.timing.budget import Budget
from knotwork.timing.objective_terms import terms
from knotwork.timing.rounding import with_room
from knotwork.trajectory import JointTrajectory
from knotwork.units import rounded_up
from knotwork.waypoints import CartesianWaypoint, FloatArray
from knotwork.ways.blame import to_blame
from knotwork.ways.configurations import at_time
from knotwork.ways.problem import NoWayError, Way, WayProblem
from knotwork.ways.search import find_way, stretch

MOST_SOLUTIONS = 12
"""Largest number of solutions of a pose at either end of a motion."""

STOP_TOLERANCE = 1e-6
"""Largest deviation of a joint from its path during a stop [rad or m]."""

BLAMED_CHECKS = 20_000
"""Number of configurations, at most twice, tested for the objects that block."""


def clear_motion(
    task: FreeTask,
    segment: Segment,
    problem: TimingProblem,
    watch: Budget,
    start: FloatArray | None = None,
) -> TimedMotion:
    """The fastest collision-free motion found for a segment, proved.

    Args:
        task: The task.
        segment: A segment with `way: clear`.
        problem: Its timing problem.
        watch: Budget and progress of all segments.
        start: Joint positions at the end of the previous motion, shape (d,), or `None`.

    Raises:
        NoWayFoundError: No motion was found, or an end is not clear.
    """
    asked, robot = segment.way, task.space.robot
    if asked is None or robot is None:
        raise TypeError("the segment has no way: clear")
    if start is not None:
        problem = replace(problem, position=np.stack((start, *problem.position[1:])))
    wanted = WayProblem(
        problem,
        _solutions(task, segment, problem, robot, 0),
        _solutions(task, segment, problem, robot, -1),
        robot.model,
        _bodies(task, segment),
        task.scenario.scene.rules.resolution,
        lambda: _stop(task, segment, problem),
    )
    begun, tries = watch.now(), 0

    def report(number: int, best: Way | None) -> None:
        nonlocal tries
        tries, seconds = number, best.duration if best is not None else None
        text, share = f"way {number} of {asked.tries}", (number - 1) / asked.tries
        watch.step(1, seconds, text, share)

    try:
        with watch.part(1):
            way = find_way(
                wanted,
                tries=asked.tries,
                room=asked.room,
                late=lambda: watch.late(found=True),
                report=report,
            )
    except NoWayError as none:
        error = _reported(none, wanted, task, segment)
        if len(wanted.starts) == len(wanted.goals) == 1:
            error.waypoints = segment.waypoints
        raise error from None
    curve = _slowed(way, wanted, problem, task, segment)
    found = _timed(way, curve, problem, wanted)
    room = way.room if asked.room else None
    return replace(found, seconds=watch.now() - begun, tries=tries, room=room)


def _timed(
    way: Way, curve: PiecewisePolynomial, problem: TimingProblem, wanted: WayProblem
) -> TimedMotion:
    """The timed motion of a found one, like that of any segment."""
    least = min(
        lower_bound(replace(problem, position=np.stack((first, *problem.position[1:-1], last))))
        for first in wanted.starts
        for last in wanted.goals
    )
    time = way.time * (float(curve.x[-1]) / way.duration)
    inner = time[1:-1]
    velocity, acceleration = np.array(problem.velocity), np.array(problem.acceleration)
    velocity[1:-1], acceleration[1:-1] = curve(inner, 1), curve(inner, 2)
    return TimedMotion(
        JointTrajectory(
            problem.joint_names,
            curve,
            joint_units=problem.joint_units,
            planner="way",
            waypoint_times=time,
        ),
        time,
        velocity,
        acceleration,
        least,
        status="resting" if way.rests else "optimal",
        binding=binding_limits(problem, time, curve),
        objective=terms(problem, curve),
        line=way.line,
    )


def _stop(task: FreeTask, segment: Segment, problem: TimingProblem) -> PiecewisePolynomial | None:
    """The previous motion, stopped on its path or at its end."""
    if task.scenario.under_way is None or segment.waypoints[0]:
        return None
    motion, at = task.scenario.under_way
    curve, limits = motion.polynomial, problem.limits
    columns = [motion.joint_names.index(name) for name in problem.joint_names]
    curve = cut_curve(PiecewisePolynomial(curve.c[:, :, columns], curve.x), at, float(curve.x[-1]))
    curve = PiecewisePolynomial(curve.c, curve.x - at)
    stopped = stop_on_path(curve, 0.0, limits.acceleration, limits.jerk, STOP_TOLERANCE)
    return curve if stopped is None else stopped[1]


def _bodies(task: FreeTask, segment: Segment) -> CollisionModel:
    """Bodies present during a segment, at provisional times; they must not change.

    Raises:
        InputError: The bodies change during the segment, or an obstacle moves.
    """
    times = task.waypoints.time[segment.rows]
    middles = (0.5 * (times[:-1] + times[1:])).tolist()
    found = [at_time(task.collision_model, when) for when in middles]
    for one, i in zip(found[1:], segment.waypoints[1:-1], strict=True):
        if one.pairs != found[0].pairs:
            raise task.located(
                InputError(
                    "the velocity is chosen, but a body comes or goes here; accepted: stop, or a "
                    "velocity"
                ),
                i,
            )
    own = task.space.robot.model.njoints if task.space.robot is not None else 0
    bodies = (found[0].bodies[k] for pair in found[0].pairs for k in (pair.first, pair.second))
    if moving := dict.fromkeys(one.name.split("/")[0] for one in bodies if one.joint >= own):
        raise task.located(
            InputError(
                f"does not support moving obstacles ({', '.join(moving)}); "
                "accepted: no way here, and waypoints around them with times or after: fastest"
            ),
            segment.waypoints[-1],
        )
    return found[0]


def _solutions(
    task: FreeTask, segment: Segment, problem: TimingProblem, robot: Robot, end: int
) -> FloatArray:
    """Joint positions at the start, 0, or the end, -1, of a motion, shape (m, d).

    All solutions of the pose, nearest to the other end first, if nothing depends on
    the choice: the arm stops there, nothing precedes the start, and a motion after the end is
    collision-free as well.
    """
    scenario, i = task.scenario, segment.waypoints[end]
    chosen, waypoint = problem.position[end], scenario.waypoints[i]
    given = scenario.task.waypoints[scenario.index[i]]
    if not isinstance(waypoint, CartesianWaypoint) or not isinstance(given, PoseWaypoint):
        return np.array(chosen[None])
    tied = i + 1 < len(scenario.waypoints) and i + 1 not in task.free.ways if end else i > 0
    fixed = (
        given.near is not None
        or scenario.task.near is not None
        or scenario.branch != "free"
        or problem.velocity[end].any()
        or tied
        or waypoint.standing
    )
    if fixed:
        return np.array(chosen[None])
    solutions = [q for one in robot.solve_pose_ik_all(waypoint.pose) for q in one.turns]
    found = np.array([chosen, *solutions])
    far = (np.abs(found - problem.position[-1 - end]) / problem.limits.velocity).max(axis=1)
    order = np.argsort(far, kind="stable")[:MOST_SOLUTIONS]
    return np.concatenate((chosen[None], found[order[order > 0]]))


def _slowed(
    way: Way, wanted: WayProblem, problem: TimingProblem, task: FreeTask, segment: Segment
) -> PiecewisePolynomial:
    """The motion stretched to the given time, if there is one."""
    given = float(problem.total or problem.duration.sum())
    least = float(problem.at_least.sum())
    duration = max(way.duration, least) if np.isnan(given) else given
    if duration == way.duration:
        return way.curve
    curve = stretch(wanted, way, duration) if duration > way.duration else None
    if curve is None:
        error = InputError(
            f"{duration:g} s is shorter than the fastest motion found, which takes "
            f"{rounded_up(way.duration):.6g} s; accepted: {with_room(way.duration):.6g} s or more, "
            "or no time"
            if duration < way.duration
            else f"a motion of {duration:g} s is infeasible with the velocities at its ends; "
            "accepted: no time, or a stop at both ends"
        )
        raise task.located(error, segment.waypoints[-1])
    return curve


def _reported(
    none: NoWayError, wanted: WayProblem, task: FreeTask, segment: Segment
) -> NoWayFoundError:
    """The error for a missing motion, at the waypoint of the fault."""
    # the fault is at an end, or at a waypoint in between, by index
    k = int(none.end) if none.end.isdigit() else {"start": 0}.get(none.end, -1)
    names = [task.scenario.waypoints[i].name for i in segment.waypoints]
    fault = segment.waypoints[k]
    message = f"no collision-free motion from {names[0]!r} to {names[-1]!r}"
    if not none.end:
        blamed = to_blame(wanted, BLAMED_CHECKS)
        message += f" was found among {none.checks} configurations; one may exist all the same"
        if blamed is None:
            message += ", and none without the objects"
        elif blamed:
            several = "all of " if len(blamed) > 1 else ""
            message += f". A motion exists without {several}{', '.join(map(repr, blamed))}"
        message += "; accepted: more space, a waypoint in between, or a smaller scene.margin"
        return task.located(NoWayFoundError(message, names=tuple(blamed or ())), fault)
    depth, unit = none.depth, "m"
    if none.joint is not None:
        joint, unit = task.space.joint_names[none.joint], task.space.joint_units[none.joint]
    much = task.scenario.units.text(depth, unit, ".4g")
    stopping = "stopping after" if k == 0 else "coming from rest to"
    where = f"{stopping if none.moving or none.joint is not None else 'at'} {names[k]!r}"
    if none.joint is not None:
        message += (
            f": {where}, {joint} goes {much} beyond its position limit; accepted: a lower velocity "
            "there, or a stop"
        )
    else:
        first, second = none.bodies
        count = none.solutions
        all_of_them = f", and none of {count} solutions is clear" if count > 1 else ""
        message += (
            f": {where}, {second} is {much} too close to {first}{all_of_them}; accepted: "
            f"{'a lower velocity or ' if none.moving else ''}another pose there, a smaller "
            "scene.margin, or objects elsewhere"
        )
    error = NoWayFoundError(message, end=none.end, names=none.bodies, depth=none.depth)
    return task.located(error, fault)
