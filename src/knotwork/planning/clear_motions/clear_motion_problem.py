"""Problem and result of a collision-free motion, and the error without one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.scene.collision_model import CollisionModel
from knotwork.verification.bounds.clearance import Clearance, clearances


@dataclass(frozen=True, eq=False)
class ClearMotion:
    """A motion between two states, proved clear.

    Attributes:
        curve: Joint positions over time, from time 0 on: cubic, C2.
        time: Times of the waypoints [s], shape (n,).
        line: The polyline from which it was planned, shape (n, d).
        parts: The motion from the first state to rest, the one that rests at the corners of the
            polyline, and the one from rest to the last state, each from time 0 on, or `None`.
        rests: Whether it rests at corners of the polyline between the waypoints.
        extra_clearance: Clearance that it keeps beyond the required one [m].
        tries: Number of searches of which it is the fastest.
    """

    curve: PiecewisePolynomial
    time: FloatArray
    line: FloatArray
    parts: Sequence[PiecewisePolynomial | None]
    rests: bool
    extra_clearance: float = 0.0
    tries: int = 1

    @property
    def duration(self) -> float:
        """Duration of the motion [s]."""
        return float(self.curve.x[-1])


@dataclass(frozen=True, eq=False)
class ClearMotionProblem:
    """Two states, and the constraints of the motion between them.

    Attributes:
        timing: Waypoints, with known velocities and accelerations at the first and the last, and
            the limits, including jerk.
        starts, goals: Solutions of the first and of the last waypoint, shape (m, d) each; `timing`
            has the first of each. There are several only if the arm is at rest there.
        arm_model: Pinocchio model of the arm.
        collision_model: Bodies and their pairs.
        resolution: Gap below which a clearance may count as a violation [m].
        continued: A motion through the first state, and its time there [s], or `None`. The arm
            stops on its path if independent stops of the joints collide.
    """

    timing: TimingProblem
    starts: FloatArray
    goals: FloatArray
    arm_model: Any
    collision_model: CollisionModel
    resolution: float = 1e-4
    continued: tuple[PiecewisePolynomial, float] | None = None

    @property
    def loaded_arm_model(self) -> Any:
        """Pinocchio model of the arm with its load, or `None` if no effort is limited."""
        dynamics = self.timing.dynamics
        limited = dynamics is not None and np.isfinite(self.timing.limits.effort).any()
        return dynamics.robot.model if dynamics is not None and limited else None

    def unproved_pairs(self, curve: PiecewisePolynomial) -> list[Clearance]:
        """Pairs that collide over a motion, or are not proved to keep their clearance."""
        results = clearances(self.collision_model, curve, self.resolution, precision=np.inf)
        return [clearance for clearance in results if clearance.state != "clear"]


@dataclass(eq=False)
class ClearSearchError(Exception):
    """No motion was found, which does not prove that none exists. `NoWayFoundError` tells users.

    Attributes:
        waypoint_index: Waypoint of the section where the arm collides, or can't come to rest along
            its velocity without a collision, -1 for the goal; `None` if all are collision-free.
        bodies: Names of the two colliding bodies.
        shortfall: Missing clearance [m], or violation of the joint's position limit [rad or m].
        moving: Whether the motion to rest collides.
        limit: Name of the limit that the motion to rest exceeds, or `None`.
        joint: Index of the joint that exceeds it.
        checks: Number of configurations checked.
        solutions: Number of solutions of the waypoint, all of which collide.
    """

    waypoint_index: int | None = None
    bodies: tuple[str, str] = ("", "")
    shortfall: float = 0.0
    moving: bool = False
    limit: str | None = None
    joint: int = 0
    checks: int = 0
    solutions: int = 1
