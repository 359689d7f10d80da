"""Damped least squares on the pose error, inside joint limits: one local search of pose IK."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from eigenpy import LDLT  # type: ignore[import-untyped]

from knotwork.arrays import FloatArray
from knotwork.robot import Robot
from knotwork.robot.kinematics.chain.joint_ranges import Limits, find_blocked_joints

MAX_STEP = 1.0
"""Largest motion of a joint in a step.

Beyond it the linearisation is not valid, and the search leaves the neighbourhood of the start.
"""
FIRST_FACTOR = 1e-2
"""First factor of the damping λ² = factor · error².

The damping is large where the error is large. Near the solution it decreases fast enough to keep
quadratic convergence (Fan and Yuan, Computing 74, 2005).
"""
MAX_FACTOR = 1e8
"""Factor of the damping at which a search ends."""
CLOSE_ERROR = 0.3
"""Error below which a search gets the usual budget, because the solution is near [m, rad]."""
HALVED_SQUARE = 0.25
"""Ratio of the squares of an error and of its half."""
TOLERANCE_MARGIN = 0.9
"""Fraction of the tolerances that searches must reach, so that rounding does not decide."""
POLISHED_SHARE = 1e-4
"""Fraction of the tolerances at which a search ends."""
POLISH_STEPS = 2
"""Maximum number of further steps of a search whose error is within the tolerances."""


class SearchBudget(NamedTuple):
    """The maximum effort of a local search.

    Attributes:
        iterations: Maximum number of steps.
        patience: Number of steps in which the error must halve.
        min_factor: Minimum factor of the damping.
        relaxes_near_pose: Whether `USUAL_BUDGET` takes its place close to the pose.
    """

    iterations: int = 80
    patience: int = 12
    min_factor: float = 1e-6
    relaxes_near_pose: bool = False


USUAL_BUDGET = SearchBudget()
"""Usual budget: a search that has not halved its error in twelve steps is at a local minimum.

Even at a singularity of a stretched arm, a Newton step reduces the error to a quarter.
"""
PATIENT_BUDGET = SearchBudget(iterations=400, patience=60)
"""Budget for poses at simultaneous singularities, where convergence takes longer."""
HASTY_BUDGET = SearchBudget(patience=5, min_factor=1e-2, relaxes_near_pose=True)
"""Budget of a search for any solution, which stops earlier and keeps more damping.

Over random poses this takes the smallest total number of steps.
"""


class LocalSolution(NamedTuple):
    """The end of a local search.

    Attributes:
        q: Joint positions [rad or m], shape (d,).
        position_error: Distance of the TCP from the pose [m].
        orientation_error: Angle from the pose [rad].
        iterations: Number of steps.
        converged: Whether both errors are within the tolerances.
    """

    q: FloatArray
    position_error: float
    orientation_error: float
    iterations: int
    converged: bool


class PoseSearch:
    """Local searches for one pose of the TCP of one robot.

    The error is e = (Rᵀ(p* − p), log₃(RᵀR*)), in tool axes. J is the Jacobian of the TCP in tool
    axes; −J is not quite the derivative of e. Still, −Jᵀe is the exact gradient of |e|²/2, because
    w is an eigenvector of the Jacobian of log₃ at w, and |p* − p| does not depend on R. Each step
    solves (JᵀJ + λ² I) Δq = Jᵀe over the joints that are not fixed at a limit.

    Args:
        robot: The robot.
        pose: Pose of the TCP in the base frame, `pin.SE3`.
        position_tolerance: Position tolerance [m].
        orientation_tolerance: Orientation tolerance [rad].
        orientation_weight: Weight of the orientation error; 0 ignores the orientation.
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
        self.robot = robot
        self.pose = pose
        self._model = robot.model
        self._data = robot.data
        self._frame = robot.require_tool()
        self._H = np.empty((robot.dof, robot.dof))
        self._ldlt = LDLT(robot.dof)
        self.tolerances = position_tolerance, orientation_tolerance
        self._target = robot.base_placement * pose
        # An error of zero weight has no tolerance.
        self._max_position = position_tolerance if position_weight else math.inf
        self._max_orientation = orientation_tolerance if orientation_weight else math.inf
        self._weights: FloatArray | None = None
        if (position_weight, orientation_weight) != (1.0, 1.0):
            self._weights = np.repeat([position_weight, orientation_weight], 3)

    def is_within(self, position_error: float, orientation_error: float) -> bool:
        """Whether errors of position [m] and orientation [rad] are within the tolerances."""
        return position_error <= self._max_position and orientation_error <= self._max_orientation

    def distance_and_angle(self, q: FloatArray) -> tuple[float, float]:
        """Distance of the TCP from the pose [m], and angle from it [rad]."""
        _, _, position, orientation = self._error(q)
        return math.sqrt(position), math.sqrt(orientation)

    def value_and_gradient(self, q: FloatArray) -> tuple[float, FloatArray]:
        """|e|²/2 and its gradient −Jᵀe, shape (d,)."""
        e, square, _, _ = self._error(q)
        return 0.5 * square, np.asarray(-self._last_jacobian().T.dot(e))

    def measure(self, q: FloatArray) -> LocalSolution:
        """Measure a configuration, as if it were the end of a search."""
        errors = self.distance_and_angle(q)
        return LocalSolution(q, *errors, 0, self.is_within(*errors))

    def jacobian(self, q: FloatArray) -> FloatArray:
        """Jacobian of the TCP in tool axes, its rows weighted, shape (6, d)."""
        self._error(q)
        return self._last_jacobian()

    def steady_acceleration(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Acceleration of the TCP in tool axes while the joints move steadily, shape (6,)."""
        pin.forwardKinematics(self._model, self._data, q, v, np.zeros_like(v))
        a = pin.getFrameClassicalAcceleration(self._model, self._data, self._frame, pin.LOCAL)
        return np.asarray(a.vector)

    def _error(self, q: FloatArray) -> tuple[FloatArray, float, float, float]:
        """Weighted error e, shape (6,), |e|², and the squares of distance [m²] and angle [rad²]."""
        pin.computeJointJacobians(self._model, self._data, q)
        placement = pin.updateFramePlacement(self._model, self._data, self._frame)
        off = placement.actInv(self._target)
        # The angular part of log₆ is log₃, and log₆ gives an array directly.
        e = pin.log6(off).vector
        e[:3] = off.translation
        x, y, z, u, v, w = e.tolist()
        position, orientation = x * x + y * y + z * z, u * u + v * v + w * w
        if self._weights is None:
            return e, position + orientation, position, orientation
        e *= self._weights
        return e, float(e.dot(e)), position, orientation

    def _last_jacobian(self) -> FloatArray:
        """The Jacobian at the last evaluation of the error."""
        J: FloatArray = pin.getFrameJacobian(self._model, self._data, self._frame, pin.LOCAL)
        if J.ndim == 1:  # of a single joint
            J = J[:, np.newaxis]
        return J if self._weights is None else J * self._weights[:, np.newaxis]

    def _step(
        self, J: FloatArray, gradient: FloatArray, blocked: Any, damping: float
    ) -> FloatArray:
        """The step of unblocked joints, (JᵀJ + λ² I)⁻¹ Jᵀe, shortened to `MAX_STEP`."""
        H = self._H
        J.T.dot(J, out=H)
        for i in blocked:
            H[i] = H[:, i] = 0.0
        H.reshape(-1)[:: len(H) + 1] += damping + 1e-30
        self._ldlt.compute(H)
        step: FloatArray = self._ldlt.solve(gradient).reshape(-1)  # (1, 1) with a single joint
        moves = step.tolist()
        if max(moves) > MAX_STEP or min(moves) < -MAX_STEP:
            step *= MAX_STEP / max(map(abs, moves))
        return step

    def solve(
        self, start: FloatArray, limits: Limits, budget: SearchBudget = USUAL_BUDGET
    ) -> LocalSolution:
        """Search from a start.

        Args:
            start: Joint positions [rad or m], shape (d,); clipped to the limits.
            limits: Joint limits.
            budget: Maximum effort.
        """
        # For six numbers the overhead of NumPy dominates, so no array is computed or read twice.
        lower, upper = limits[0].tolist(), limits[1].tolist()
        enough = (POLISHED_SHARE * min(self.tolerances)) ** 2
        max_position, max_orientation = self._max_position**2, self._max_orientation**2
        q, at_limit = _clip(start, lower, upper)
        e, square, position, orientation = self._error(q)
        if not square < math.inf:
            return LocalSolution(q.copy(), math.inf, math.inf, 0, False)
        if budget.relaxes_near_pose and square <= CLOSE_ERROR**2:
            budget = USUAL_BUDGET
        factor = FIRST_FACTOR
        checkpoint = square
        polished = iteration = 0
        accepted = True
        while iteration < budget.iterations:
            if position <= max_position and orientation <= max_orientation:
                if polished == POLISH_STEPS or square <= enough:
                    break
                polished += 1
            if (iteration + 1) % budget.patience == 0:
                if square > HALVED_SQUARE * checkpoint:
                    break
                checkpoint = square
            iteration += 1
            if accepted:
                J = self._last_jacobian()
                gradient = J.T.dot(e)
                blocked = np.array([], dtype=int)
                if at_limit:
                    blocked = np.flatnonzero(find_blocked_joints(q, gradient, limits))
                    gradient[blocked] = 0.0
            step = self._step(J, gradient, blocked, factor * square)
            candidate, touches = _clip(q + step, lower, upper)
            trial = self._error(candidate)
            accepted = trial[1] < square
            if accepted:
                q, at_limit = candidate, touches
                e, square, position, orientation = trial
                factor = max(0.2 * factor, budget.min_factor)
            elif polished or factor > MAX_FACTOR or not step.any():
                break
            else:
                factor *= 8.0
        errors = math.sqrt(position), math.sqrt(orientation)
        q = q.copy() if q is start else q
        return LocalSolution(q, *errors, iteration, self.is_within(*errors))


def _clip(q: FloatArray, lower: list[float], upper: list[float]) -> tuple[FloatArray, bool]:
    """Clip joint positions to limits; return also whether a joint is at a limit."""
    joints = list(zip(q.tolist(), lower, upper))  # noqa: B905 (slower)
    for position, low, high in joints:
        if not low < position < high:
            return np.array([min(max(x, least), most) for x, least, most in joints]), True
    return q, False
