"""Joint position, velocity, acceleration and jerk over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from knotwork.errors import InputError
from knotwork.scenario import Scenario
from knotwork.units import Units
from knotwork.view.headings import CURVE_LETTERS, picture_title, write_around
from knotwork.view.joint_panels import Series, joint_panel
from knotwork.view.panel import new_axes, new_figure, page_size, set_ranges
from knotwork.view.plotted_motions import (
    check_distinct,
    choose_names,
    choose_quantities,
    motions_of,
)
from knotwork.view.shown_motion import Drawable, ShownMotion
from knotwork.view.style import printable, settings, shorten_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Number of joints up to which they are compared in columns, with all planners in each.
MOST_JOINT_COLUMNS = 3
# Otherwise each planner has its own column.
MOST_MOTION_COLUMNS = 4


def plot_joints(
    motions: Drawable | Sequence[Drawable],
    *,
    joints: Sequence[str] | None = None,
    quantities: Sequence[str] | None = None,
    degrees: bool | None = None,
    scenario: Scenario | None = None,
    labels: Sequence[str] | None = None,
    title: str | None = None,
    size: str | None = None,
) -> Figure:
    """Draw joint motions over time, one row of panels per quantity.

    Joints of one motion share a panel, with the limits of the joint nearest to its own. Several
    motions have one column per joint if there are at most three joints, otherwise one per motion.
    Jumps, waypoints and knots are marked, and the parts of curves whose exact extrema exceed a
    limit.

    Args:
        motions: A `Plan`, a `JointTrajectory`, or several of them.
        joints: Names of the joints to draw; by default all.
        quantities: Some of `"position"`, `"velocity"`, `"acceleration"`, `"jerk"`; default all.
        degrees: Show angles in degrees or in radians; by default the unit of the scenario.
        scenario: Scenario of trajectories, to mark waypoints and limits.
        labels: A name for each motion; by default its planner.
        title: Title of the picture; by default the scenario and the planner.
        size: `"a4"` or `"slide"`; by default as large as the panels need.

    >>> figure = plot_joints(kw.plan("planar2_closed_form"), quantities=["position", "velocity"])
    >>> len(figure.axes)
    2

    Raises:
        InputError: A name is unknown, no curve or too many curves would be drawn, or joints differ.
    """
    drawn = motions_of(motions, scenario=scenario, labels=labels)
    names = choose_names("joint", joints, drawn[0].trajectory.joint_names)
    kinds = choose_quantities(quantities)
    page, units = page_size(size), drawn[0].units(degrees)
    in_columns = len(drawn) == 1 or len(names) > MOST_JOINT_COLUMNS
    rows = _joints_together(drawn, names, kinds) if in_columns else _overlaid(drawn, names, kinds)
    labels = [motion.label for motion in drawn]
    titles = labels if in_columns else names
    with settings():
        figure = new_figure(len(rows), len(titles), page)
        grid = new_axes(figure, len(rows), len(titles), shared=in_columns)
        _draw_panels(grid, rows, units, shared=in_columns)
        write_around(
            figure,
            drawn,
            picture_title(drawn, "joint motions") if title is None else title,
            names if in_columns else labels,
            titles=titles if len(drawn) > 1 else [""],
            overlaid=not in_columns,
            grows=page is None,
        )
    return figure


def _draw_panels(grid: Any, rows: Sequence[_Row], units: Units, *, shared: bool) -> None:
    """Draw the panels; those of a row may share their range and the name of their quantity."""
    for line, row in zip(grid, rows, strict=True):
        panels = [joint_panel(axes, *cell, units) for axes, cell in zip(line, row, strict=True)]
        for group in [panels] if shared else [[panel] for panel in panels]:
            set_ranges(group)
    if shared:
        for axes in grid[:, 1:].flat:
            axes.set_ylabel("")


_Row = list[tuple[str, list[Series]]]
"""Quantity and curves of each panel."""


def _overlaid(motions: list[ShownMotion], names: list[str], kinds: list[str]) -> list[_Row]:
    """One column per joint, with all motions."""
    check_distinct(motions)
    return [
        [
            (
                kind,
                [
                    Series(motion, name, i, printable(motion.label))
                    for i, motion in enumerate(motions)
                ],
            )
            for name in names
        ]
        for kind in kinds
    ]


def _joints_together(motions: list[ShownMotion], names: list[str], kinds: list[str]) -> list[_Row]:
    """One column per motion, with separate rows for angles and lengths.

    Raises:
        InputError: There is too much for one picture.
    """
    if len(motions) > MOST_MOTION_COLUMNS:
        raise InputError(
            f"{len(motions)} motions of {len(names)} joints are too much for one picture; "
            f"choose at most {MOST_MOTION_COLUMNS} motions, or at most {MOST_JOINT_COLUMNS} "
            "joints"
        )
    first = motions[0].trajectory
    units = dict(zip(first.joint_names, first.joint_units, strict=True))
    short = shorten_names(names, CURVE_LETTERS) if len(names) > 1 else [""]
    of_unit = [[i for i, name in enumerate(names) if units[name] == unit] for unit in ("rad", "m")]
    return [
        [(kind, [Series(motion, names[i], i, short[i]) for i in group]) for motion in motions]
        for kind in kinds
        for group in filter(None, of_unit)
    ]
