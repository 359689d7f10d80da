"""Joint position, velocity, acceleration and jerk over time."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from knotwork.errors import InputError
from knotwork.scenario import Scenario
from knotwork.units import Units
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
from knotwork.view.panel import draw_panel
from knotwork.view.style import (
    SMALL,
    checked_size,
    new_figure,
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
        UnknownNameError: There is no such joint, quantity or size.
        InputError: There is nothing or too much to draw, or the motions' joints differ.
    """
    found = windowed(motions_of(motions, scenario=scenario, labels=labels), window)
    names = chosen("joint", joints, found[0].trajectory.joint_names)
    kinds = chosen_quantities(quantities)
    page = checked_size(size)
    together = not split and (len(found) == 1 or len(names) > MOST_JOINT_COLUMNS)
    overlaid = not together and len(found) > 1
    cells = _joints_together(found, names, kinds) if together else _overlaid(found, names, kinds)
    cells = cells if together or split else list(map(list, zip(*cells, strict=True)))
    owners, columns = [one.label for one in found], len(cells[0])
    heads = owners if together else kinds if split else names
    with settings():
        figure = _draw(cells, found[0].units(degrees), page, shared=together, split=split)
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


def _draw(
    cells: list[_Row],
    units: Units,
    page: tuple[float, float] | None,
    *,
    shared: bool,
    split: bool,
) -> Figure:
    """Draw panels with their curves, limits and labels; a row is `shared` that has one scale."""
    rows, columns = len(cells), len(cells[0])
    figure = new_figure(rows, columns, page)
    axes = figure.subplots(rows, columns, sharex=True, squeeze=False)
    for line, row in zip(axes, cells, strict=True):
        panels = [joint_panel(quantity, series, units) for quantity, series in row]
        spans = np.array([panel.span() for panel in panels])
        if shared:
            spans[:] = spans[:, 0].min(), spans[:, 1].max()
        for axis, panel, span in zip(line, panels, spans, strict=True):
            if split:
                panel.title = ""
            draw_panel(axis, panel, span, rows, columns)
        if shared:
            limits = np.array([axis.get_ylim() for axis in line])
            for axis in line:
                axis.set_ylim(limits.min(), limits.max())
            for axis in line[1:]:
                axis.set_ylabel("")
        if split:
            line[0].set_ylabel(
                f"{_row_name(row[0][1][0].joint)}\n[{panels[0].unit}]", fontsize=SMALL
            )
    figure.align_ylabels()
    return figure


def _row_name(joint: str) -> str:
    """The name of a joint, in short lines."""
    (name,) = shortened([joint], MOST_LEGEND_LETTERS)
    parts = textwrap.wrap(name.replace("_", "_ "), ROW_LETTERS, break_long_words=False)
    return "\n".join(part.replace("_ ", "_") for part in parts)
