"""Motions of segments that find their own way past everything that they may not touch."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from knotwork.choosing.segments import Segment
from knotwork.choosing.task import FreeTask
from knotwork.errors import InputError, NoWayFoundError
from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.task import PoseWaypoint
from knotwork.timing import TimedMotion, TimingProblem
from knotwork.timing.binding import binding_limits
from knotwork.timing.bounds import lower_bound
from knotwork.timing.budget import Watch
from knotwork.timing.infeasible import rounded_up, with_room
from knotwork.timing.objective_terms import terms
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import CartesianWaypoint, FloatArray
from knotwork.ways.configurations import at_time
from knotwork.ways.search import NoWayError, Way, WayProblem, find_way, lasting, to_blame

MOST_GOALS = 12
"""Solutions of a pose that a way may end at."""

BLAMED_CHECKS = 20_000
"""Configurations looked at, object by object, to see which of them is in the way."""


def clear_motion(
    task: FreeTask,
    segment: Segment,
    problem: TimingProblem,
    watch: Watch,
    start: FloatArray | None = None,
) -> TimedMotion:
    """The fastest motion found for a segment that keeps clear of everything, proved.

    Args:
        task: The task.
        segment: A segment that finds its way.
        problem: What is known of it.
        watch: What follows the solution of all segments.
        start: Joint positions where the way before it has ended, shape (d,), or `None`.

    Raises:
        NoWayFoundError: None was found, or one of its ends is not clear.
    """
    asked, robot = segment.way, task.space.robot
    if asked is None or robot is None:
        raise TypeError("the segment does not find its way")
    _check_velocities(task, segment, problem)
    if start is not None:
        problem = replace(problem, position=np.stack((start, problem.position[1])))
    when = float(np.mean(task.waypoints.time[segment.rows]))
    wanted = WayProblem(
        replace(problem, duration=np.array([np.nan]), at_least=np.zeros(1), total=None),
        _goals(task, segment, problem, robot),
        robot.model,
        at_time(task.collision_model, when),
    )
    begun, search = watch.now(), _Search(watch, asked.tries)
    try:
        with watch.part(1):
            way = find_way(
                wanted,
                tries=asked.tries,
                room=asked.room,
                late=lambda: watch.late(found=True),
                found=search.found,
                trying=search.trying,
            )
    except NoWayError as none:
        raise _reported(none, wanted, task, segment) from None
    curve = _slowed(way, wanted, problem, task, segment)
    time = np.array([0.0, float(curve.x[-1])])
    return TimedMotion(
        JointTrajectory(
            problem.joint_names,
            curve,
            joint_units=problem.joint_units,
            planner="way",
            waypoint_times=time,
        ),
        time,
        problem.velocity,
        problem.acceleration,
        lower_bound(problem),
        status="resting" if way.duration >= way.resting else "optimal",
        binding=binding_limits(problem, time, curve),
        objective=terms(problem, curve),
        seconds=watch.now() - begun,
        line=way.line,
        tries=search.number,
    )


@dataclass(eq=False)
class _Search:
    """Reports the progress of the search for a way: what exists already, and what is tried."""

    watch: Watch
    tries: int
    number: int = 0
    duration: float | None = None

    def trying(self, number: int) -> None:
        self.number = number
        self._report()

    def found(self, way: Way) -> None:
        self.duration = way.duration
        self._report()

    def _report(self) -> None:
        trying = f"way {self.number} of {self.tries}"
        self.watch.step(self.duration or np.inf, 0.0, self.duration, trying)


def _goals(task: FreeTask, segment: Segment, problem: TimingProblem, robot: Robot) -> FloatArray:
    """Joint positions that a way may end at, the nearest first, shape (m, d).

    They are all solutions of the pose where nothing else depends on which it is: the arm stops
    there, and what follows, if anything, is a way as well.
    """
    scenario, last = task.scenario, segment.waypoints[1]
    chosen, waypoint = problem.position[1], scenario.waypoints[last]
    given = scenario.task.waypoints[scenario.index[last]]
    if not isinstance(waypoint, CartesianWaypoint) or not isinstance(given, PoseWaypoint):
        return np.array(chosen[None])
    fixed = (
        given.near is not None
        or scenario.task.near is not None
        or scenario.branch != "free"
        or problem.velocity[1].any()
        or (last + 1 < len(scenario.waypoints) and last + 1 not in task.free.ways)
    )
    if fixed:
        return np.array(chosen[None])
    solutions = [q for one in robot.solve_pose_ik_all(waypoint.pose) for q in one.turns]
    found = np.array([chosen, *solutions])
    far = (np.abs(found - problem.position[0]) / problem.limits.velocity).max(axis=1)
    order = np.argsort(far, kind="stable")[:MOST_GOALS]
    return np.concatenate((chosen[None], found[order[order > 0]]))


def _slowed(
    way: Way, wanted: WayProblem, problem: TimingProblem, task: FreeTask, segment: Segment
) -> PiecewisePolynomial:
    """The way in the time that is given for it, if one is."""
    given = float(problem.total or problem.duration[0])
    least = float(problem.at_least[0])
    duration = max(way.duration, least) if np.isnan(given) else given
    if duration == way.duration:
        return way.curve
    curve = lasting(wanted, way, duration) if duration > way.duration else None
    if curve is None:
        error = InputError(
            f"{duration:g} s is shorter than the fastest way found, which lasts "
            f"{rounded_up(way.duration):.6g} s; accepted: {with_room(way.duration):.6g} s or more, "
            "or no time"
            if duration < way.duration
            else f"the arm can't take {duration:g} s for its way with the velocities at its ends; "
            "accepted: no time, or a stop at both ends"
        )
        raise task.located(error, segment.waypoints[1])
    return curve


def _check_velocities(task: FreeTask, segment: Segment, problem: TimingProblem) -> None:
    """Refuse a velocity at an end of a way that is to be chosen, or positions beyond limits."""
    for place, i in enumerate(segment.waypoints):
        if not problem.velocity_known[place]:
            raise task.located(
                InputError(
                    "the velocity is chosen, but a way begins or ends here; accepted: stop, or a "
                    "velocity"
                ),
                i,
            )


def _reported(none: NoWayError, wanted: WayProblem, task: FreeTask, segment: Segment) -> InputError:
    """The error for a way that was not found, at the waypoint where the fault is."""
    text = task.scenario.units.text
    start, goal = segment.waypoints
    where = "where the way begins" if none.end == "start" else "where it ends"
    depth, unit = none.depth, "m"
    if none.joint is not None:
        joint, unit = task.space.joint_names[none.joint], task.space.joint_units[none.joint]
        message = (
            f"with the velocity {where} {joint} goes {text(depth, unit)} beyond its position limit "
            "until the arm is at rest; give a lower velocity, or a stop"
        )
    elif none.end:
        first, second = none.bodies
        coming = ", when the arm has come to rest from the velocity there" if none.moving else ""
        message = (
            f"no way: {where}{coming}, {second} is {text(depth, unit)} within the margin of {first}"
            "; move one of them, or give a smaller margin"
        )
        message += " or a lower velocity" if none.moving else ""
    else:
        blamed = to_blame(wanted, BLAMED_CHECKS)
        message = (
            f"no way found from {task.scenario.waypoints[start].name!r}, after {none.checks} "
            "configurations were looked at; this is no proof that there is none"
        )
        if blamed:
            message += f". There is one without {' and one without '.join(blamed)}"
        message += "; give more tries, a waypoint on the way, or more space"
        return task.located(NoWayFoundError(message, names=tuple(blamed)), goal)
    error = NoWayFoundError(message, end=none.end, names=none.bodies, depth=none.depth)
    return task.located(error, start if none.end == "start" else goal)
