"""Events, loads and segments of a motion."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, Literal

SegmentKind = Literal["free motion", "way", "tool path", "wait"]

TIME_TOLERANCE = 1e-9
"""Difference within which times are equal [s]."""


class MotionPart:
    """Base class of the data that are stored with a motion."""

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid", "allow_inf_nan": False}

    def to_dict(self) -> dict[str, Any]:
        """Return all fields as plain data, ready for JSON."""
        return asdict(self)  # type: ignore[call-overload,no-any-return]  # of a dataclass


@dataclass(frozen=True)
class Event(MotionPart):
    """A signal or output switched during a motion.

    Attributes:
        time: Time [s].
        name: Name of the signal; `"output 3"` for an output without a name.
        value: `True` for on, `False` for off, a number or text.
        waypoint: Name of the waypoint at which it is defined.
        output: Number of the digital output, or `None`.

    >>> Event(1.5, "gripper", "close", "pick").text
    'gripper close'
    """

    time: float
    name: str
    value: bool | float | str
    waypoint: str
    output: int | None = None

    @property
    def signal(self) -> str | int:
        """The number of the output, or the name of the signal."""
        return self.name if self.output is None else self.output

    @property
    def text(self) -> str:
        """Name and value as text."""
        words = {True: "on", False: "off"}
        shown = words[self.value] if isinstance(self.value, bool) else f"{self.value}"
        return f"{self.name} {shown}"


def signals_on_at(events: Iterable[Event], time: float) -> list[Event]:
    """Find the last event of each signal that is on at a time [s].

    A signal is on unless its value is off, 0 or a text.

    >>> signals_on_at([Event(1, "arc", True, "a"), Event(2, "arc", False, "b")], 1.5)[0].text
    'arc on'
    """
    state = {event.signal: event for event in events if event.time <= time}
    return [event for event in state.values() if event.value and not isinstance(event.value, str)]


@dataclass(frozen=True)
class Load(MotionPart):
    """Load of the arm from a time on: the tool, and the objects that it holds.

    Attributes:
        time: Time [s].
        mass: Total mass [kg].
        centre_of_mass: Centre of mass in the axes of the frame [m].
        frame: Name of the link that carries the load.
        inertia: Inertia about that centre in the frame's axes: xx, yy, zz, xy, xz, yz [kg m²].
    """

    time: float
    mass: float
    centre_of_mass: tuple[float, float, float]
    frame: str
    inertia: tuple[float, float, float, float, float, float] = (0.0,) * 6


@dataclass(frozen=True)
class Segment(MotionPart):
    """A part of a motion, from one waypoint to the next.

    Attributes:
        name: Name, from those of the waypoints: `"pick to place"`, `"wait at pick"`.
        start, end: Start and end time [s].
        kind: `"free motion"`, `"way"` (planned past obstacles), `"tool path"` or `"wait"`.
    """

    name: str
    start: float
    end: float
    kind: SegmentKind

    @property
    def text(self) -> str:
        """Name, kind and times as text."""
        kind = "" if self.kind == "wait" else f"{self.kind}, "  # the name says it
        return f"{self.name}: {kind}{self.start:.3f} s to {self.end:.3f} s"
