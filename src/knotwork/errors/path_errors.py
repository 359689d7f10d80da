"""Errors of infeasible tool paths, independent of the arm."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from knotwork.errors.base import InputError


class PathError(InputError):
    """A tool path, or a part of one, that can't be made as specified.

    Attributes:
        text: The message with the names of `values` in braces; empty without values.
        values: Lengths [m] and points in the axes of the path [m] of the message.
    """

    text: str = ""
    values: Mapping[str, Any] = MappingProxyType({})

    def in_units(self, length: Callable[[float], str], point: Callable[[Any], str]) -> str:
        """The message with its lengths and points in another unit or frame.

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
        highest_speed: The highest feasible speed, its neighbours unchanged [m/s]; `None` without
            one.
        lowest_acceleration: The lowest feasible acceleration [m/s²].
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
