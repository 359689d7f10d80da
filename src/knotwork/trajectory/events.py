"""What happens on the way of a motion, and what the motion consists of."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Literal

SegmentKind = Literal["free motion", "way", "tool path", "wait"]


@dataclass(frozen=True)
class Event:
    """Something that is switched at a moment of a motion.

    Attributes:
        time: When [s].
        name: Of the signal; `"output 3"` for an output without a name.
        value: `True` for on, `False` for off, a number or text.
        waypoint: Name of the waypoint that it was given at.
        output: Number of the digital output that it switches, or `None`.

    >>> Event(1.5, "gripper", "close", "pick").said
    'gripper close'
    """

    time: float
    name: str
    value: bool | float | str
    waypoint: str
    output: int | None = None

    @property
    def signal(self) -> str | int:
        """The output that is switched, by number, or the signal, by its name."""
        return self.name if self.output is None else self.output

    @property
    def said(self) -> str:
        """Name and value in words."""
        words = {True: "on", False: "off"}
        shown = words[self.value] if isinstance(self.value, bool) else f"{self.value}"
        return f"{self.name} {shown}"

    def to_dict(self) -> dict[str, Any]:
        """Give it as plain data, ready for JSON."""
        return asdict(self)


def on_at(events: Iterable[Event], time: float) -> list[Event]:
    """What is on at a time [s]: of each signal the last event, unless it is off, 0 or a text.

    >>> on_at([Event(1, "arc", True, "a"), Event(2, "arc", False, "b")], 1.5)[0].said
    'arc on'
    """
    state = {one.signal: one for one in events if one.time <= time}
    return [one for one in state.values() if one.value and not isinstance(one.value, str)]


@dataclass(frozen=True)
class Load:
    """What the arm carries from a moment of a motion on: the tool, and what it holds.

    Attributes:
        time: When [s].
        mass: Of all of it [kg].
        centre_of_mass: In the axes of the frame [m].
        frame: Name of the link that carries it.
        inertia: About that centre, in the axes of the frame: xx, yy, zz, xy, xz, yz [kg m²].
    """

    time: float
    mass: float
    centre_of_mass: tuple[float, float, float]
    frame: str
    inertia: tuple[float, float, float, float, float, float] = (0.0,) * 6

    def to_dict(self) -> dict[str, Any]:
        """Give it as plain data, ready for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class Segment:
    """A part of a motion, from one waypoint to the next.

    Attributes:
        name: Made of the names of the waypoints: `"pick to place"`, `"wait at pick"`.
        start, end: When it begins and ends [s].
        kind: `"free motion"`, `"way"` (it found its way), `"tool path"` or `"wait"`.
    """

    name: str
    start: float
    end: float
    kind: SegmentKind

    @property
    def said(self) -> str:
        """All of it in words."""
        kind = "" if self.kind == "wait" else f"{self.kind}, "  # its name says so
        return f"{self.name}: {kind}{self.start:.3f} s to {self.end:.3f} s"

    def to_dict(self) -> dict[str, Any]:
        """Give it as plain data, ready for JSON."""
        return asdict(self)
