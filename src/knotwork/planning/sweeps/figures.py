"""Figures of a motion in a row of a study, taken from its plan and report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from knotwork.errors import UnknownNameError
from knotwork.joint_quantities import FRAME_ORDERS, JOINT_QUANTITIES
from knotwork.verification.limits import SMALLEST_SINGULAR_VALUE
from knotwork.verification.metrics import squared_effort

if TYPE_CHECKING:
    from knotwork.planning import Plan


@dataclass(frozen=True)
class RowFigure:
    """A figure of a row, whose value is `None` if the plan does not have it.

    >>> from knotwork.planning.sweeps import FIGURES
    >>> FIGURES["clearance"].unit, FIGURES["clearance"].more_is_better
    ('m', True)

    Attributes:
        name: Name of its column.
        title: Title in pictures.
        unit: SI unit; empty for a fraction of a limit and for singular values.
        more_is_better: Whether the best row has the largest value.
        value_of: Function that computes the figure from a plan.
    """

    name: str
    title: str
    unit: str
    more_is_better: bool
    value_of: Callable[[Plan], float | None]


def _utilisation_figure(quantity: str) -> RowFigure:
    """Figure for the largest utilisation of a kind of limit."""
    # the tool also has findings on position, at waypoints
    kind = {"subject": "joint"} if quantity in JOINT_QUANTITIES else {}

    def max_utilisation(plan: Plan) -> float | None:
        findings = plan.report.select(quantity=quantity, **kind)
        if any(finding.only_sampled for finding in findings):
            return None  # the utilisation is unknown
        utilisations = (finding.utilisation for finding in findings)
        return max((value for value in utilisations if value is not None), default=None)

    title = f"utilisation of limits of {quantity.replace('_', ' ')}"
    return RowFigure(f"{quantity}_use", title, "", False, max_utilisation)


def _extreme(extreme: Callable[..., float | None], plan: Plan, **wanted: object) -> float | None:
    """The minimum or maximum of the values of findings, selected by their attributes."""
    values = (finding.value for finding in plan.report.select(**wanted))
    return extreme((value for value in values if value is not None), default=None)


def _squared_effort(plan: Plan) -> float | None:
    if plan.joints.loaded_robots is None:
        return None
    return sum(squared_effort(*part) for part in plan.joints.loaded_robots.parts(plan.trajectory))


_min_singular_value = partial(_extreme, min, quantity=SMALLEST_SINGULAR_VALUE)
_path_deviation = partial(_extreme, max, quantity="path_deviation")
_scene_clearance = partial(_extreme, min, subject="pair", involves_scene=True)
_self_clearance = partial(_extreme, min, subject="pair", involves_scene=False)

FIGURES: dict[str, RowFigure] = {
    figure.name: figure
    for figure in (
        RowFigure("duration", "duration", "s", False, lambda plan: plan.trajectory.duration),
        RowFigure(
            SMALLEST_SINGULAR_VALUE, "smallest singular value", "", True, _min_singular_value
        ),
        RowFigure("clearance", "clearance to the surroundings", "m", True, _scene_clearance),
        RowFigure("self_clearance", "clearance to itself", "m", True, _self_clearance),
        *(_utilisation_figure(quantity) for quantity in (*JOINT_QUANTITIES, *FRAME_ORDERS)),
        RowFigure("path_deviation", "deviation from the path", "m", False, _path_deviation),
        RowFigure("squared_effort", "integral of effort squared", "N²m²s", False, _squared_effort),
    )
}
"""All figures by name, in the order of the columns."""


def get_figure(name: str) -> RowFigure:
    """Find a figure.

    Raises:
        UnknownNameError: The figure is unknown.
    """
    if name not in FIGURES:
        raise UnknownNameError("figure", name, FIGURES)
    return FIGURES[name]
