"""What a way is asked for, what it is, and why there is none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.scene.model import CollisionModel
from knotwork.timing.problem import TimingProblem
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class Way:
    """A motion between two states that is proved clear.

    Attributes:
        curve: Joint positions over time, from time 0 on: cubic, C2.
        time: When it passes the waypoints [s], shape (n,).
        line: The polyline that it was made from, shape (n, d).
        through: The problem with the polyline's corners as waypoints, or `None` where the motion
            comes to rest or from rest other than straight.
        rests: Whether it rests at corners of the polyline between the waypoints.
        room: Clearance that it keeps beyond the margins [m].
    """

    curve: PiecewisePolynomial
    time: FloatArray
    line: FloatArray
    through: TimingProblem | None
    rests: bool
    room: float = 0.0

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.curve.x[-1])


@dataclass(frozen=True, eq=False)
class WayProblem:
    """Two states, and what the motion between them has to keep.

    Attributes:
        timing: Waypoints, the first and the last of whose velocities and accelerations are known,
            and the limits; jerk is limited.
        starts, goals: Solutions of the first and of the last one, shape (m, d) each, the first of
            which `timing` has; more than one only where the arm is at rest there.
        robot: Pinocchio model of the arm.
        model: Bodies that are there, and their pairs.
        resolution: A clearance nearer than this to its margin may count as not kept [m].
        stop: Gives a motion from the first state to rest, or `None`. It is looked at where braking
            along the velocity is not clear.
    """

    timing: TimingProblem
    starts: FloatArray
    goals: FloatArray
    robot: object
    model: CollisionModel
    resolution: float = 1e-4
    stop: Callable[[], PiecewisePolynomial | None] = lambda: None

    @property
    def loaded(self) -> Any:
        """Pinocchio model of the arm and what it carries, or `None` if no effort is limited."""
        dynamics = self.timing.dynamics
        limited = dynamics is not None and np.isfinite(self.timing.limits.effort).any()
        return dynamics.robot.model if dynamics is not None and limited else None


class NoWayError(Exception):
    """No way was found. That is no proof that there is none.

    Attributes:
        end: `"start"`, `"goal"` or the number of a waypoint between them where the arm is too near
            to something, or can't come to rest along its velocity without being so; empty where all
            are free.
        bodies: Names of the two bodies that are too near there.
        depth: By how much [m], or how far the joint goes beyond its limit [rad or m].
        moving: Whether it is the motion to rest that is not clear.
        joint: Index of the joint that goes beyond its position limit until the arm is at rest.
        checks: Number of configurations looked at.
        solutions: Number of solutions of the end, all of which collide.
    """

    def __init__(
        self,
        end: str = "",
        bodies: tuple[str, str] = ("", ""),
        depth: float = 0.0,
        moving: bool = False,
        joint: int | None = None,
        checks: int = 0,
        solutions: int = 1,
    ) -> None:
        super().__init__()
        self.end, self.bodies, self.depth, self.moving = end, bodies, depth, moving
        self.joint, self.checks, self.solutions = joint, checks, solutions
