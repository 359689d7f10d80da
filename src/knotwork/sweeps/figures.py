"""What a row says of a motion: the figures of its report, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from knotwork.errors import UnknownNameError
from knotwork.joint_quantities import JOINT_QUANTITIES
from knotwork.verification import Report


@dataclass(frozen=True)
class Figure:
    """One figure of a row; it is `None` where the report does not have it.

    >>> from knotwork.sweeps import FIGURES
    >>> FIGURES["clearance"].unit, FIGURES["clearance"].more_is_better
    ('m', True)

    Attributes:
        name: Of its column.
        title: In words, for pictures.
        unit: SI unit; empty for a part of a limit and for singular values.
        more_is_better: Whether the best row is the one with the most.
        of: Takes it from a report.
    """

    name: str
    title: str
    unit: str
    more_is_better: bool
    of: Callable[[Report], float | None]


# Limits of tool and links by the quantity in findings; those of joints have a table of their own.
_TOOL_LIMITS = ("tool_speed", "tool_acceleration", "frame_speed")


def _use(quantity: str) -> Figure:
    """Figure for the largest part of a kind of limit that is used."""
    # tools have a position at waypoints as well
    kind = {"subject": "joint"} if quantity in JOINT_QUANTITIES else {}

    def of(report: Report) -> float | None:
        return _extreme(max, (found.use for found in report.select(quantity=quantity, **kind)))

    title = f"largest part used of a limit of {quantity.replace('_', ' ')}"
    return Figure(f"{quantity}_use", title, "", False, of)


def _value(quantity: str, title: str, unit: str, *, least: bool) -> Figure:
    """Figure for the least or the largest value of findings."""

    def of(report: Report) -> float | None:
        pick = min if least else max
        return _extreme(pick, (found.value for found in report.select(quantity=quantity)))

    return Figure(quantity, title, unit, least, of)


def _extreme(pick: Callable[[list[float]], float], values: Iterable[float | None]) -> float | None:
    known = [float(value) for value in values if value is not None]
    return pick(known) if known else None


def _duration(report: Report) -> float | None:
    return report.end_time - report.start_time


FIGURES: dict[str, Figure] = {
    one.name: one
    for one in (
        Figure("duration", "duration", "s", False, _duration),
        _value("smallest_singular_value", "smallest singular value", "", least=True),
        _value("clearance", "clearance", "m", least=True),
        *(_use(quantity) for quantity in (*JOINT_QUANTITIES, *_TOOL_LIMITS)),
        _value("path_deviation", "deviation from the path", "m", least=False),
    )
}
"""All figures by name, in the order of the columns."""


def figure_named(name: str) -> Figure:
    """Find a figure.

    Raises:
        UnknownNameError: There is none of this name.
    """
    if name not in FIGURES:
        raise UnknownNameError("figure", name, FIGURES)
    return FIGURES[name]
