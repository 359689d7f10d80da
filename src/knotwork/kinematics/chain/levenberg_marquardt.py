"""Damped least squares on the pose error, inside joint limits: one local search of pose IK."""

from __future__ import annotations

import math
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import pinocchio as pin
from eigenpy import LDLT  # type: ignore[import-untyped]

from knotwork.robot import Robot
from knotwork.waypoints import FloatArray

# A search that has not halved its error in so many iterations is at a local minimum. Even where
# the arm is stretched to a singularity, Newton's step still quarters the error; only where it is
# singular in more than one way at once it takes longer, and more patience.
STALL_ITERATIONS = 12
PATIENT = 60
PATIENT_ITERATIONS = 400
# One of many searches for any solution gives up sooner and keeps more damping: over random poses
# that takes the fewest steps in all.
HASTY_STALL_ITERATIONS = 5
HASTY_MIN_FACTOR = 1e-2
# A search that starts this near its pose has the solution it is for in reach [m, rad].
CLOSE = 0.3
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


class LocalSolution(NamedTuple):
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

    @property
    def miss(self) -> float:
        """Distance and angle together, a metre counting as a radian."""
        return self.position_error + self.orientation_error


class _Workspace:
    """What all searches with a robot share, like Pinocchio's working memory.

    Attributes:
        model, data, frame: Of the robot.
        base: Where its base stands, `pin.SE3`; `None` if in the origin.
        H: Memory for JᵀJ, shape (d, d).
        diagonal: Its diagonal, a view.
        ldlt: Its factorisation.
    """

    def __init__(self, robot: Robot) -> None:
        self.model, self.data, self.frame = robot.model, robot.data, robot.require_tool()
        base, d = robot.base_placement, robot.dof
        self.base = None if base.isIdentity(0.0) else base
        self.H, self.ldlt = np.empty((d, d)), LDLT(d)
        self.diagonal = self.H.reshape(-1)[:: d + 1]


_workspaces: WeakKeyDictionary[Robot, _Workspace] = WeakKeyDictionary()


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
        work = _workspaces.get(robot)
        if work is None:
            work = _workspaces[robot] = _Workspace(robot)
        self.robot, self.pose, self._work = robot, pose, work
        self._tolerances = position_tolerance, orientation_tolerance
        self._target = pose if work.base is None else work.base * pose
        # An error of no weight has no tolerance to be within.
        self._position_tolerance = position_tolerance if position_weight else math.inf
        self._orientation_tolerance = orientation_tolerance if orientation_weight else math.inf
        self._weights: FloatArray | None = None
        if (position_weight, orientation_weight) != (1.0, 1.0):
            self._weights = np.repeat([position_weight, orientation_weight], 3)

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
        return (
            position_error <= self._position_tolerance
            and orientation_error <= self._orientation_tolerance
        )

    def errors(self, q: FloatArray) -> tuple[float, float]:
        """Distance of the TCP from the pose [m], and angle from it [rad]."""
        _, _, position, orientation = self._error(q)
        return math.sqrt(position), math.sqrt(orientation)

    def error(self, q: FloatArray) -> FloatArray:
        """Weighted error e, shape (6,)."""
        return self._error(q)[0]

    def gradient(self, q: FloatArray) -> FloatArray:
        """Jᵀe: where the joints would go to come nearer, shape (d,)."""
        e = self._error(q)[0]
        return np.asarray(self._jacobian_here().T.dot(e))

    def jacobian(self, q: FloatArray) -> FloatArray:
        """Jacobian of the TCP in tool axes, its rows weighted, shape (6, d)."""
        work = self._work
        pin.computeJointJacobians(work.model, work.data, q)
        pin.updateFramePlacement(work.model, work.data, work.frame)
        return self._jacobian_here()

    def bend(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Acceleration of the TCP in tool axes while the joints move steadily, shape (6,)."""
        work = self._work
        pin.forwardKinematics(work.model, work.data, q, v, np.zeros_like(v))
        a = pin.getFrameClassicalAcceleration(work.model, work.data, work.frame, pin.LOCAL)
        return np.asarray(a.vector)

    def _jacobian_here(self) -> FloatArray:
        """The same where the error has been evaluated last."""
        work = self._work
        J: FloatArray = pin.getFrameJacobian(work.model, work.data, work.frame, pin.LOCAL)
        if J.ndim == 1:  # of a single joint
            J = J[:, np.newaxis]
        return J if self._weights is None else J * self._weights[:, np.newaxis]

    def _error(self, q: FloatArray) -> tuple[FloatArray, float, float, float]:
        """Weighted error e, shape (6,), |e|², and the squares of the errors [m²], [rad²]."""
        work = self._work
        pin.computeJointJacobians(work.model, work.data, q)
        off = pin.updateFramePlacement(work.model, work.data, work.frame).actInv(self._target)
        # The angular part of log₆ is log₃, and it makes the array at once.
        e = pin.log6(off).vector
        e[:3] = off.translation
        x, y, z, u, v, w = e.tolist()
        position, orientation = x * x + y * y + z * z, u * u + v * v + w * w
        if self._weights is None:
            return e, position + orientation, position, orientation
        e *= self._weights
        return e, float(e.dot(e)), position, orientation

    def solve(
        self,
        start: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        max_iterations: int = MAX_ITERATIONS,
        polish_iterations: int = POLISH_ITERATIONS,
        hasty: bool = False,
        patience: int = STALL_ITERATIONS,
    ) -> LocalSolution:
        """Search from a start.

        Args:
            start: Joint positions [rad or m], shape (d,); taken inside the limits.
            lower: Limits that the search stays within, shape (d,).
            upper: Likewise.
            max_iterations: Steps to try at most.
            polish_iterations: Of those, how many within the tolerances.
            hasty: Unless the start is close, give up soon: there are other searches for a
                solution, whichever it is.
            patience: Steps in which the error must halve, unless hasty.
        """
        # This is the inner loop of all that solves for single poses: no array is made, checked or
        # looked through twice, because for six numbers NumPy's overhead is all there is.
        joints, place, log6 = pin.computeJointJacobians, pin.updateFramePlacement, pin.log6
        work, weights, target = self._work, self._weights, self._target
        model, data, frame, H = work.model, work.data, work.frame, work.H
        diagonal, compute, solve = work.diagonal, work.ldlt.compute, work.ldlt.solve
        lows, highs = lower.tolist(), upper.tolist()
        most_position, most_orientation = (
            self._position_tolerance**2,
            self._orientation_tolerance**2,
        )
        enough = (POLISHED * min(self._tolerances)) ** 2
        q, at, at_limit = _inside(start, lows, highs)
        e, square, position, orientation = self._error(q)
        if not square < math.inf:
            return LocalSolution(q.copy(), math.inf, math.inf, 0, False)
        hasty = hasty and square > CLOSE**2
        patience = HASTY_STALL_ITERATIONS if hasty else patience
        least_factor = HASTY_MIN_FACTOR if hasty else MIN_FACTOR
        factor, checkpoint, polished, iteration, accepted = FIRST_FACTOR, square, 0, 0, True
        while iteration < max_iterations:
            if position <= most_position and orientation <= most_orientation:
                if polished == polish_iterations or square <= enough:
                    break
                polished += 1
            if iteration % patience == patience - 1:
                if square > 0.25 * checkpoint:
                    break
                checkpoint = square
            iteration += 1
            if accepted:
                J = self._jacobian_here()
                JT = J.T
                gradient = JT.dot(e)
                held = _held(at, lows, highs, gradient.tolist()) if at_limit else ()
                if held:
                    gradient[held] = 0.0
            JT.dot(J, out=H)
            for i in held:
                H[i] = 0.0
                H[:, i] = 0.0
            diagonal += factor * square + 1e-30
            compute(H)
            step = solve(gradient)
            if len(lows) == 1:
                step = step.reshape(1)  # from (1, 1)
            moves = step.tolist()
            if max(moves) > MAX_STEP or min(moves) < -MAX_STEP:
                step *= MAX_STEP / max(map(abs, moves))
            candidate = q + step
            moved, clipped = candidate.tolist(), False
            for angle, low, high in zip(moved, lows, highs):  # noqa: B905 (slower)
                if not low < angle < high:
                    candidate, moved, clipped = _inside(candidate, lows, highs)
                    break
            # as in `_error`, without the call
            joints(model, data, candidate)
            off = place(model, data, frame).actInv(target)
            error = log6(off).vector
            error[:3] = off.translation
            x, y, z, u, v, w = error.tolist()
            far, turned = x * x + y * y + z * z, u * u + v * v + w * w
            if weights is None:
                trial = far + turned
            else:
                error *= weights
                trial = float(error.dot(error))
            accepted = trial < square
            if accepted:
                q, at, at_limit, e, square = candidate, moved, clipped, error, trial
                position, orientation = far, turned
                factor = max(0.2 * factor, least_factor)
            else:
                if polished or factor > MAX_FACTOR or not any(moves):
                    break
                factor *= 8.0
        if q is start:
            q = start.copy()
        errors = math.sqrt(position), math.sqrt(orientation)
        return LocalSolution(q, *errors, iteration, self.within(*errors))


def _inside(
    q: FloatArray, lower: list[float], upper: list[float]
) -> tuple[FloatArray, list[float], bool]:
    """The nearest joint positions inside limits, as array and list, and whether one is at them."""
    at = q.tolist()
    for angle, low, high in zip(at, lower, upper, strict=True):
        if not low < angle < high:
            at = [min(max(a, b), c) for a, b, c in zip(at, lower, upper, strict=True)]
            return np.array(at), at, True
    return q, at, False


def _held(at: list[float], lower: list[float], upper: list[float], slope: list[float]) -> list[int]:
    """Joints at a limit that a step along the slope would take beyond it."""
    return [
        i
        for i, (q, low, high, rising) in enumerate(zip(at, lower, upper, slope, strict=True))
        if (q <= low and rising < 0.0) or (q >= high and rising > 0.0)
    ]
