"""What a picture of the tool shows, row by row: its motion, its tolerances and its limits."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from knotwork.joint_quantities import rate_unit
from knotwork.scenario import MotionLimits, ToleranceSet
from knotwork.view.motions import Motion
from knotwork.view.tool_curves import (
    Curve,
    least_singular_values,
    path_deviations,
    place_rates,
    robot_of,
    speed_errors,
    speeds,
    straight_deviations,
)

PERCENT = 1e2


@dataclass(frozen=True)
class Row:
    """A row of panels: what it shows.

    Attributes:
        title: What is measured.
        unit: Unit that it is shown in.
        factor: From SI to that unit.
        curve: Function that measures a motion.
        component: Which of its values is shown.
        asked: What of a waypoint's velocity is marked, `"linear"` or `"angular"`, or nothing.
        limit: What is allowed, in SI, or `None`.
        tolerance: Whether that is allowed along tool paths and to either side, else all the time.
        judged: Quantity and name of the findings on that limit.
        least: Whether the limit is one from below.
    """

    title: str
    unit: str
    factor: float
    curve: Callable[[Motion], Curve]
    component: int
    asked: str = ""
    limit: float | None = None
    tolerance: bool = False
    judged: tuple[str, str] = ("", "")
    least: bool = False


def tool_rows(motions: list[Motion], degrees: bool | None) -> list[Row]:
    """What may be shown; a row without any value is left out."""
    for motion in motions:
        robot_of(motion)  # that there is one is said before anything is drawn
    scenario = motions[0].scenario
    allowed = scenario.tolerances if scenario is not None else ToleranceSet()
    units = motions[0].units(degrees)
    factor, angle = units.shown(1.0, "rad")
    metres, length = units.shown(1.0, "m")
    return [
        Row(
            *("tool speed", f"{length}/s", metres, speeds, 0, "linear"),
            limit=scenario.motion_limits.tool_speed if scenario is not None else None,
            judged=("tool_speed", ""),
        ),
        Row("turning speed", f"{angle}/s", factor, speeds, 1, "angular"),
        Row("speed error", "%", PERCENT, speed_errors, 0, limit=allowed.path_speed, tolerance=True),
        Row(
            "off tool path", length, metres, path_deviations, 0, limit=allowed.path, tolerance=True
        ),
        Row(
            *("turned from it", angle, factor, path_deviations, 1),
            limit=allowed.path_orientation,
            tolerance=True,
        ),
        Row("off straight path", length, metres, straight_deviations, 0),
        Row("turned from it", angle, factor, straight_deviations, 1),
        *(_limit_rows(scenario.motion_limits, metres, length) if scenario is not None else ()),
    ]


def _limit_rows(limits: MotionLimits, factor: float, unit: str) -> Iterator[Row]:
    """What is limited and not shown otherwise."""

    def of_place(name: str, order: int, limit: float, frame: str, quantity: str) -> Row:
        curve = partial(place_rates, frame=frame, order=order)
        shown = rate_unit(unit, order)
        return Row(name, shown, factor, curve, 0, limit=limit, judged=(quantity, frame))

    if limits.tool_acceleration is not None:
        yield of_place("tool acceleration", 2, limits.tool_acceleration, "", "tool_acceleration")
    for one in limits.frame_speed:
        yield of_place(f"speed of {one.frame}", 1, one.speed, one.frame, "frame_speed")
    if limits.singular_value is not None:
        yield Row(
            *("smallest singular value", "", 1.0, least_singular_values, 0),
            limit=limits.singular_value,
            judged=("smallest_singular_value", ""),
            least=True,
        )
