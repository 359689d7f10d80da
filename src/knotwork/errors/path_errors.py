"""Errors of infeasible tool paths."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from knotwork.errors.base import InputError
from knotwork.errors.tasks import TaskError
from knotwork.units import SI, Units, rounded_down

ObstructionCause = Literal["joint limit", "velocity limit", "collision", "singularity"]

NEARLY_SINGULAR = 0.05
"""Smallest singular value below which a singularity explains high joint speeds."""


class PathError(InputError):
    """A tool path, or a part of one, that can't be made as specified.

    Attributes:
        text: Template of the message, with names of `values` in braces; empty without values.
        values: Lengths [m], and points in the axes of the path [m], for the template.
        path_start: Index of the waypoint of a scenario where the path begins, if known.
    """

    text: str = ""
    values: Mapping[str, Any] = MappingProxyType({})
    path_start: int | None = None

    def in_units(self, length: Callable[[float], str], point: Callable[[Any], str]) -> str:
        """Write the message with its lengths and points in another unit or frame.

        Args:
            length: Formats a length [m].
            point: Formats a point [m], shape (3,).
        """
        if not self.text:
            return str(self)
        return self.text.format(
            **{k: length(v) if isinstance(v, float) else point(v) for k, v in self.values.items()}
        )


class CornerError(PathError):
    """A tool path with a sudden change of direction where the tool does not stop.

    Attributes:
        junction: Index of the curve before the corner.
        angle: Change of direction [rad].
        point: Position of the corner [m].
    """

    junction: int = 0
    angle: float = 0.0
    point: tuple[float, ...] = ()


class RampError(PathError):
    """A stretch of a tool path that is too short for its changes of speed.

    Attributes:
        stretch: Index of the stretch.
        length: Its length [m].
        needed: Length required by its changes of speed [m].
        highest_speed: Highest speed of the stretch that is feasible with the present speeds of its
            neighbours [m/s]; `None` if no speed is.
        lowest_acceleration: Lowest acceleration for which the length is sufficient [m/s²].
    """

    stretch: int = 0
    length: float = 0.0
    needed: float = 0.0
    highest_speed: float | None = None
    lowest_acceleration: float = 0.0


class StretchTimeError(PathError):
    """A stretch of a tool path that can't take the given time.

    Attributes:
        stretch: Index of the stretch.
        shortest, longest: Lower and upper bound of its time [s]; `longest` may be infinite.
    """

    stretch: int = 0
    shortest: float = 0.0
    longest: float = 0.0


class FollowingObstruction(NamedTuple):
    """The first obstruction of an arm that follows a path.

    Attributes:
        cause: `"joint limit"`, `"velocity limit"`, `"collision"` or `"singularity"`; the last means
            that the tool can't stay on the path with any joint motion.
        time: Time from which the path can't be followed [s].
        joint: Name of the joint that exceeds its limit; empty for other kinds.
        unit: Unit of its position, `"rad"` or `"m"`.
        value: Worst position or speed of the joint [rad or m, or per second].
        limit: Limit that this value exceeds [rad or m, or per second].
        smallest_singular_value: Smallest singular value of the Jacobian at the worst time.
        bodies: Names of two bodies that collide.
    """

    cause: ObstructionCause
    time: float
    joint: str = ""
    unit: str = "rad"
    value: float = 0.0
    limit: float = 0.0
    smallest_singular_value: float = math.nan
    bodies: tuple[str, str] = ("", "")

    def text(self, units: Units) -> str:
        """Write it as a clause of a message."""
        smallest = f"smallest singular value {self.smallest_singular_value:.3g}"
        if self.cause == "singularity":
            return f"the arm is stretched out or singular and can't continue ({smallest})"
        if self.cause == "collision":
            first, second = ("the tool" if name == "tool" else name for name in self.bodies)
            return f"{first} is too near to {second}"
        unit = self.unit if self.cause == "joint limit" else f"{self.unit}/s"
        value, limit = (units.text(number, unit, ".4g") for number in (self.value, self.limit))
        if self.cause == "joint limit":
            return f"{self.joint} reaches its limit {limit}; it would have to move to {value}"
        is_near = self.smallest_singular_value < NEARLY_SINGULAR
        near = f" (close to a singularity, {smallest})" if is_near else ""
        return (
            f"{self.joint} would have to move at {value}, and its limit is {limit}{near}, which it "
            f"keeps at {rounded_down(self.limit / self.value, 3):g} times the speed of the tool"
        )


class FollowingError(TaskError):
    """A tool path that the arm can't follow.

    Attributes:
        arc_length: Length of the path that the arm can follow, from its start [m].
        cause: `"joint limit"`, `"velocity limit"`, `"singularity"` or `"collision"`.
        joint: Name of the joint that would be beyond its limit; empty if no limit is the cause.
        value: Position or speed that the joint would have [rad or m, or per second], or `None`.
        limit: Limit that this value exceeds [rad or m, or per second], or `None`.
        path_start: Index of the waypoint of a scenario where the path begins, if known.
    """

    arc_length: float = 0.0
    cause: ObstructionCause | Literal[""] = ""
    joint: str = ""
    value: float | None = None
    limit: float | None = None
    path_start: int | None = None

    def __init__(
        self,
        waypoint: str,
        obstruction: FollowingObstruction,
        *,
        beginning: str,
        accepted: str,
        distance: float,
        units: Units = SI,
        **data: Any,
    ) -> None:
        at = f"{units.text(distance, 'm', '.4g')} along it" if distance > 0.0 else "at its start"
        super().__init__(
            waypoint,
            f"{beginning}: {at} {obstruction.text(units)}; accepted: {accepted}",
            prefixed=False,
            cause=obstruction.cause,
            joint=obstruction.joint,
            value=obstruction.value if obstruction.joint else None,
            limit=obstruction.limit if obstruction.joint else None,
            **data,
        )
