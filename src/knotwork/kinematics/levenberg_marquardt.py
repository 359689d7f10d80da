"""Damped least squares on the pose error, inside joint limits: one local search of pose IK."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from eigenpy import LDLT  # type: ignore[import-untyped]

from knotwork.errors import RobotError
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray

# A search that has not halved its error in so many iterations is at a local minimum. Even where
# the arm is stretched to a singularity, Newton's step still quarters the error.
STALL_ITERATIONS = 12
MAX_ITERATIONS = 80
# No joint moves further in a step: linearisation says nothing beyond, and longer steps leave the
# neighbourhood of the start.
MAX_STEP = 1.0
# Damping λ² = factor · error²: vanishes at the solution fast enough to keep quadratic convergence
# (Fan and Yuan, Computing 74, 2005), and is large where the error is.
FIRST_FACTOR = 1e-2
MIN_FACTOR = 1e-6
MAX_FACTOR = 1e8
# Once inside the tolerances, go on until the error is this part of them, or so many times.
POLISHED = 1e-4
POLISH_ITERATIONS = 2


@dataclass(frozen=True, eq=False)
class LocalSolution:
    """Where a local search ended.

    Attributes:
        q: Joint positions [rad or m], shape (d,).
        position_error: Distance of the TCP from the pose asked for [m].
        orientation_error: Angle from it [rad].
        iterations: Steps tried.
        converged: Whether both errors are within the tolerances.
    """

    q: FloatArray
    position_error: float
    orientation_error: float
    iterations: int
    converged: bool


class PoseSearch:
    """Local searches for one pose of the TCP of one robot.

    The error is e = (Rᵀ(p* − p), log₃(RᵀR*)), in tool axes, and J its (negative) Jacobian as far
    as it matters: because w is an eigenvector of the Jacobian of log₃ at w, Jᵀe is the exact
    gradient of |e|²/2. Each step solves (JᵀJ + λ² I) Δq = Jᵀe over the joints that are free.

    Args:
        robot: The robot.
        pose: Pose of the TCP in the base frame, `pin.SE3`.
        position_tolerance: [m].
        orientation_tolerance: [rad].
        orientation_weight: Weight of the orientation error; 0 leaves the orientation free.
        position_weight: Weight of the position error.
    """

    def __init__(
        self,
        robot: Robot,
        pose: Any,
        position_tolerance: float,
        orientation_tolerance: float,
        *,
        position_weight: float = 1.0,
        orientation_weight: float = 1.0,
    ) -> None:
        if robot.tcp_frame_id is None:
            robot.forward(robot.lower_position_limit)  # raises, naming the tool frames there are
            raise RobotError(robot.name, "has no tool frame")
        self.robot, self.pose = robot, pose
        self._tolerances = position_tolerance, orientation_tolerance
        self._frame = robot.tcp_frame_id
        self._target = robot.base_placement * pose
        # An error of no weight has no tolerance to be within.
        self._position_tolerance = position_tolerance if position_weight else np.inf
        self._orientation_tolerance = orientation_tolerance if orientation_weight else np.inf
        weights = np.repeat([position_weight, orientation_weight], 3)
        self._weights = None if (weights == 1).all() else weights
        self._identity = np.eye(robot.dof)

    def reweighted(self, *, position_weight: float, orientation_weight: float) -> PoseSearch:
        """Search for the same pose with other weights."""
        return PoseSearch(
            self.robot,
            self.pose,
            *self._tolerances,
            position_weight=position_weight,
            orientation_weight=orientation_weight,
        )

    def within(self, position_error: float, orientation_error: float) -> bool:
        """Whether errors of position [m] and orientation [rad] are within the tolerances."""
        return bool(
            position_error <= self._position_tolerance
            and orientation_error <= self._orientation_tolerance
        )

    def evaluate(self, q: FloatArray) -> tuple[FloatArray, FloatArray, float, float]:
        """Weighted error, shape (6,), and Jacobian, shape (6, d), and the errors [m], [rad]."""
        model, data, frame = self.robot.model, self.robot.data, self._frame
        pin.computeJointJacobians(model, data, q)
        error = pin.updateFramePlacement(model, data, frame).actInv(self._target)
        linear, angular = error.translation, pin.log3(error.rotation)
        J = pin.getFrameJacobian(model, data, frame, pin.LOCAL)
        if J.ndim == 1:  # of a single joint
            J = J[:, np.newaxis]
        e = np.concatenate((linear, angular))
        position, orientation = linear.dot(linear) ** 0.5, angular.dot(angular) ** 0.5
        if self._weights is not None:
            e, J = e * self._weights, J * self._weights[:, None]
        return e, J, position, orientation

    def solve(
        self,
        start: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        max_iterations: int = MAX_ITERATIONS,
        polish_iterations: int = POLISH_ITERATIONS,
    ) -> LocalSolution:
        """Search from a start.

        Args:
            start: Joint positions [rad or m], shape (d,), within the limits.
            lower: Limits that the search stays within, shape (d,).
            upper: Likewise.
            max_iterations: Steps to try at most.
            polish_iterations: Of those, how many within the tolerances.
        """
        q = start
        e, J, position, orientation = self.evaluate(q)
        square, factor = e.dot(e), FIRST_FACTOR
        polished_square = (POLISHED * min(self._tolerances)) ** 2
        checkpoint, polished, accepted, iteration = square, 0, True, 0
        at_limit = bool(((q <= lower) | (q >= upper)).any())
        while iteration < max_iterations:
            if self.within(position, orientation):
                if polished == polish_iterations or square <= polished_square:
                    break
                polished += 1
            if iteration % STALL_ITERATIONS == STALL_ITERATIONS - 1:
                if square > 0.25 * checkpoint:
                    break
                checkpoint = square
            iteration += 1
            if accepted:
                JT = J.T
                gradient, H = JT.dot(e), JT.dot(J)
                if at_limit:
                    held = ((q <= lower) & (gradient < 0)) | ((q >= upper) & (gradient > 0))
                    gradient[held] = 0.0
                    H[held] = 0.0
                    H[:, held] = 0.0
            damping = factor * square + 1e-30
            step = LDLT(H + damping * self._identity).solve(gradient).ravel()  # (1, 1) of one joint
            length = step.dot(step)
            if length > MAX_STEP**2:  # else no joint can exceed it
                step *= MAX_STEP / max(step.max(), -step.min(), MAX_STEP)
            wanted = q + step
            candidate = np.minimum(np.maximum(wanted, lower), upper)
            trial = self.evaluate(candidate)
            trial_square = trial[0].dot(trial[0])
            accepted = trial_square < square
            if accepted:
                clipped = candidate - wanted
                at_limit = at_limit or clipped.dot(clipped) > 0
                q, square = candidate, trial_square
                e, J, position, orientation = trial
                factor = max(0.2 * factor, MIN_FACTOR)
            else:
                if polished or factor > MAX_FACTOR or length == 0.0:
                    break
                factor *= 8.0
        converged = self.within(position, orientation)
        return LocalSolution(q, float(position), float(orientation), iteration, converged)
