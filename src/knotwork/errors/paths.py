"""Errors of tool paths that can't be made, whatever the arm."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from knotwork.errors.base import InputError


class PathError(InputError):
    """A tool path, or a part of one, that can't be made as asked.

    Attributes:
        text: The message with the names of `values` in braces; empty where it has none.
        values: Lengths [m] and points in the axes of the path [m] that the message names.
    """

    text: str = ""
    values: Mapping[str, Any] = MappingProxyType({})

    def in_units(self, length: Callable[[float], str], point: Callable[[Any], str]) -> str:
        """The message with its lengths and points in other words, as in another unit or frame.

        Args:
            length: Says a length [m].
            point: Says a point [m], shape (3,).
        """
        if not self.text:
            return str(self)
        return self.text.format(
            **{k: length(v) if isinstance(v, float) else point(v) for k, v in self.values.items()}
        )


class CornerError(PathError):
    """A tool path that changes its direction suddenly where the tool is to go on.

    Attributes:
        junction: Index of the curve before the corner.
        angle: How much the direction changes [rad].
        point: Where [m].
    """

    junction: int = 0
    angle: float = 0.0
    point: tuple[float, ...] = ()


class RampError(PathError):
    """A stretch of a tool path that is too short for its changes of speed.

    Attributes:
        stretch: Index of the stretch.
        length: Its length [m].
        needed: The length that its changes of speed take [m].
        highest_speed: The highest speed that would fit, its neighbours unchanged [m/s]; `None` if
            none does.
        lowest_acceleration: The least acceleration with which it would fit [m/s²].
    """

    stretch: int = 0
    length: float = 0.0
    needed: float = 0.0
    highest_speed: float | None = None
    lowest_acceleration: float = 0.0


class SlowStretchError(PathError):
    """A stretch of a tool path that is so slow that times don't resolve changes of speed.

    Attributes:
        stretch: Index of the slowest stretch.
        lowest_speed: The speed from which on they do, its neighbours as fast [m/s].
    """

    stretch: int = 0
    lowest_speed: float = 0.0


class StretchTimeError(PathError):
    """A stretch of a tool path that can't take the time asked for.

    Attributes:
        stretch: Index of the stretch.
        least, most: The times that it can take [s]; `most` may be infinite.
    """

    stretch: int = 0
    least: float = 0.0
    most: float = 0.0
