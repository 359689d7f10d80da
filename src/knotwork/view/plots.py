"""Joint position, velocity, acceleration and jerk over time."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from knotwork.errors import InputError
from knotwork.scenario import Scenario
from knotwork.view.drawn_motions import (
    Drawable,
    Motion,
    check_distinct,
    chosen,
    chosen_quantities,
    motions_of,
)
from knotwork.view.headings import MOST_LEGEND_LETTERS, head_and_foot, picture_title
from knotwork.view.joint_panels import Series, joint_panel
from knotwork.view.panel import Panel, draw_grid
from knotwork.view.style import (
    SMALL,
    checked_size,
    printable,
    settings,
    shortened,
)
from knotwork.view.time_window import WHOLE, Window, windowed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Letters in a line of a row's name.
ROW_LETTERS = 12
# Up to this number joints are compared in columns of their own, planners over each other.
MOST_JOINT_COLUMNS = 3
# With more joints each planner has a column of its own.
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
    window: Window = WHOLE,
    split: bool = False,
    size: str | None = None,
) -> Figure:
    """Draw joint motions over time, a row of panels a quantity.

    Joints of one motion share a panel, with the limits of the joint that is nearest to its own.
    Several motions of at most three joints have a column a joint, else a column a motion. Jumps,
    waypoints and knots are marked, and the parts of curves whose exact extrema break a limit.

    Args:
        motions: A `Plan`, a `JointTrajectory`, or several of them.
        joints: Names of the joints to draw; by default all.
        quantities: Of `"position"`, `"velocity"`, `"acceleration"` and `"jerk"`; by default all.
        degrees: Show angles in degrees or in radians; by default as the scenario's file does.
        scenario: For trajectories: what was asked for, to mark waypoints and limits.
        labels: A name for each motion; by default its planner.
        title: Title of the picture; by default the scenario and the planner.
        window: Start and end [s], `None` for the motion's own; use of limits is that within.
        split: A row of panels a joint instead, a column a quantity, in its unit with its limits.
        size: `"a4"` or `"slide"`; by default as large as the panels need.

    >>> figure = plot_joints(kw.plan("planar2_closed_form"), quantities=["position", "velocity"])
    >>> [axis.get_ylabel() for axis in figure.axes]
    ['position [rad]', 'velocity [rad/s]']

    Raises:
        InputError: A name is unknown, there is nothing or too much to draw, or joints differ.
    """
    found = windowed(motions_of(motions, scenario=scenario, labels=labels), window)
    names = chosen("joint", joints, found[0].trajectory.joint_names)
    kinds = chosen_quantities(quantities)
    page, units = checked_size(size), found[0].units(degrees)
    cells, heads, together = _arranged(found, names, kinds, split)
    overlaid = not together and len(found) > 1
    grid = [[joint_panel(kind, series, units) for kind, series in row] for row in cells]
    owners, columns = [one.label for one in found], len(grid[0])
    with settings():
        figure = _split(grid, names, page) if split else draw_grid(grid, page, shared=together)
        head_and_foot(
            figure,
            found,
            picture_title(found, "joint motions") if title is None else title,
            owners if overlaid else () if split else names,
            columns=columns,
            titles=heads if columns > 1 or overlaid else (),
            overlaid=overlaid,
            apart=together,
            grows=page is None,
        )
    return figure


_Row = list[tuple[str, list[Series]]]
"""Quantity and curves of each panel."""


def _arranged(
    motions: list[Motion], names: list[str], kinds: list[str], split: bool
) -> tuple[list[_Row], list[str], bool]:
    """Rows of panels, what their columns are of, and whether these are motions."""
    if not split and (len(motions) == 1 or len(names) > MOST_JOINT_COLUMNS):
        return _joints_together(motions, names, kinds), [one.label for one in motions], True
    rows = _overlaid(motions, names, kinds)
    return (
        (rows, kinds, False) if split else (list(map(list, zip(*rows, strict=True))), names, False)
    )


def _overlaid(motions: list[Motion], names: list[str], kinds: list[str]) -> list[_Row]:
    """A row a joint, of all motions."""
    check_distinct(motions)
    labels = [printable(one.label) for one in motions] if len(motions) > 1 else [""]
    rows = []
    for joint in names:
        curves = [
            Series(one, joint, i, label)
            for i, (one, label) in enumerate(zip(motions, labels, strict=True))
        ]
        rows.append([(kind, curves) for kind in kinds])
    return rows


def _joints_together(motions: list[Motion], names: list[str], kinds: list[str]) -> list[_Row]:
    """A column a motion; where both angles and lengths occur, they have rows of their own.

    Raises:
        InputError: It is too much for one picture.
    """
    if len(motions) > MOST_MOTION_COLUMNS:
        raise InputError(
            f"{len(motions)} motions of {len(names)} joints are too much for one picture; "
            f"choose at most {MOST_MOTION_COLUMNS} motions, or at most {MOST_JOINT_COLUMNS} "
            "joints"
        )
    first = motions[0].trajectory
    units = dict(zip(first.joint_names, first.joint_units, strict=True))
    short = shortened(names, MOST_LEGEND_LETTERS) if len(names) > 1 else [""]
    of_unit = [[i for i, name in enumerate(names) if units[name] == unit] for unit in ("rad", "m")]
    return [
        [(kind, [Series(motion, names[i], i, short[i]) for i in group]) for motion in motions]
        for kind in kinds
        for group in filter(None, of_unit)
    ]


def _split(grid: list[list[Panel]], joints: list[str], page: tuple[float, float] | None) -> Figure:
    """Draw a row a joint, named at its left; columns have the titles."""
    for panel in itertools.chain(*grid):
        panel.title = ""
    figure = draw_grid(grid, page)
    firsts = figure.axes[:: len(grid[0])]
    for axis, (panel, *_), joint in zip(firsts, grid, joints, strict=True):
        axis.set_ylabel(f"{_row_name(joint)}\n[{panel.unit}]", fontsize=SMALL)
    return figure


def _row_name(joint: str) -> str:
    """The name of a joint, in short lines."""
    (name,) = shortened([joint], MOST_LEGEND_LETTERS)
    parts = textwrap.wrap(name.replace("_", "_ "), ROW_LETTERS, break_long_words=False)
    return "\n".join(part.replace("_ ", "_") for part in parts)
