"""What the check found: every requirement with what was asked, achieved and allowed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np

from knotwork.errors import CheckFailedError


@dataclass(frozen=True)
class Requirement:
    """One quantity at one waypoint.

    Attributes:
        waypoint: Name of the waypoint.
        time: When [s].
        quantity: `"position"`, `"orientation"`, `"linear_velocity"`, `"angular_velocity"` of the
            tool, or `"joint_position"`, `"joint_velocity"` and, at the ends where it is asked
            for, `"joint_acceleration"`.
        requested: What was asked for; an orientation as a quaternion x, y, z, w.
        achieved: What the trajectory does, in the same form.
        error: Distance between the two; for joints, of the joint furthest off.
        tolerance: The largest error allowed.
        unit: Unit of error and tolerance.
        ok: The error is within the tolerance.
    """

    waypoint: str
    time: float
    quantity: str
    requested: tuple[float, ...]
    achieved: tuple[float, ...]
    error: float
    tolerance: float
    unit: str
    ok: bool

    def __str__(self) -> str:
        return (
            f"waypoint {self.waypoint!r} at {self.time:g} s: {self.quantity.replace('_', ' ')} is "
            f"off by {self.error:.3g} {self.unit}, tolerance {self.tolerance:.3g} {self.unit}"
        )


@dataclass(frozen=True)
class LimitUse:
    """The worst of one quantity at one joint over the whole motion, against its limit.

    Attributes:
        joint: Name of the joint.
        quantity: `"position"`, `"velocity"`, `"acceleration"`, `"jerk"` or `"effort"`.
        value: The value nearest to, or furthest beyond, its limit; infinite (`null` in JSON) where
            the quantity is that of a jump.
        limit: The limit, with the sign it has on that side; `None` if no limit is given.
        margin: Distance left to the limit, negative beyond it; `None` without one.
        time: When [s].
        unit: Unit of value, limit and margin.
        sampled: Found by sampling in time; otherwise exact, from the polynomials.
        ok: Within the limit, or no limit is given.
    """

    joint: str
    quantity: str
    value: float
    limit: float | None
    margin: float | None
    time: float
    unit: str
    sampled: bool
    ok: bool

    def __str__(self) -> str:
        if self.limit is None:
            return f"joint {self.joint!r}: {self.quantity} has no limit given"
        if np.isinf(self.value):
            return (
                f"joint {self.joint!r}: {self.quantity} is infinite at the jump at "
                f"{self.time:.6g} s, limit {self.limit:.6g} {self.unit}"
            )
        return (
            f"joint {self.joint!r}: {self.quantity} reaches {self.value:.6g} {self.unit} at "
            f"{self.time:.6g} s, limit {self.limit:.6g} {self.unit}"
        )


@dataclass(frozen=True)
class Jump:
    """The largest jump of one derivative at the breaks of the trajectory, as measured.

    Attributes:
        quantity: `"position"`, `"velocity"` or `"acceleration"`.
        value: The largest jump of any joint.
        relative: The same relative to the peak of the quantity at that joint.
        tolerance: The largest relative jump that counts as none.
        joint: Where.
        time: When [s].
        unit: Unit of the jump.
        required: The scenario asks for continuity of this quantity.
        ok: No jump, or none is required to be absent.
    """

    quantity: str
    value: float
    relative: float
    tolerance: float
    joint: str
    time: float
    unit: str
    required: bool
    ok: bool

    def __str__(self) -> str:
        return (
            f"joint {self.joint!r}: {self.quantity} jumps by {self.value:.3g} {self.unit} at "
            f"{self.time:.6g} s"
        )


@dataclass(frozen=True)
class Defect:
    """Something wrong with the trajectory as a whole.

    Attributes:
        message: What.
    """

    message: str
    ok: bool = False

    def __str__(self) -> str:
        return self.message


@dataclass(frozen=True)
class Singularity:
    """How near the motion comes to a singularity of the arm; sampled, and for information.

    Attributes:
        smallest_singular_value: Of the tool Jacobian (metres and radians mixed).
        time: When [s].
        samples: Number of times looked at.
    """

    smallest_singular_value: float
    time: float
    samples: int


@dataclass(frozen=True)
class Report:
    """The verdict on a trajectory, requirement by requirement.

    Attributes:
        scenario: Name of the scenario.
        robot: Name of the robot, or `None`.
        planner: What made the trajectory, as it says itself.
        start_time, end_time: Of the trajectory [s].
        requirements: At the waypoints.
        limits: For each joint and quantity.
        jumps: Of position, velocity and acceleration at the breaks.
        defects: Anything wrong with the trajectory as a whole.
        singularity: Nearness to singularities, or `None` without a robot.
    """

    scenario: str
    robot: str | None
    planner: str
    start_time: float
    end_time: float
    requirements: tuple[Requirement, ...]
    limits: tuple[LimitUse, ...]
    jumps: tuple[Jump, ...]
    defects: tuple[Defect, ...] = ()
    singularity: Singularity | None = None

    def _all(self) -> Iterator[Requirement | LimitUse | Jump | Defect]:
        yield from self.defects
        yield from self.requirements
        yield from self.limits
        yield from self.jumps

    @property
    def ok(self) -> bool:
        """Whether every requirement is met and every limit kept."""
        return all(item.ok for item in self._all())

    @property
    def failures(self) -> tuple[Requirement | LimitUse | Jump | Defect, ...]:
        """What is not met, in the order of the report."""
        return tuple(item for item in self._all() if not item.ok)

    def to_dict(self) -> dict[str, Any]:
        """Give the report as plain data, ready for JSON, with `ok` and the failures in words."""
        data: dict[str, Any] = {"ok": self.ok, "failures": [str(item) for item in self.failures]}
        data.update(_plain(self))
        return data

    def raise_if_failed(self) -> None:
        """Raise if anything is not met; for use in tests.

        Raises:
            CheckFailedError: Lists every failure. It is an `AssertionError`, too.
        """
        failures = self.failures
        if failures:
            lines = "\n".join(f"  {failure}" for failure in failures)
            raise CheckFailedError(self, f"{self.scenario}: {len(failures)} failed:\n{lines}")


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        return {item.name: _plain(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and np.isinf(value) else value
