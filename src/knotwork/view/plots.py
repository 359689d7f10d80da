"""Joint position, velocity, acceleration and jerk over time."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from knotwork.errors import InputError
from knotwork.scenario import Scenario
from knotwork.view.heads import (
    MOST_LEGEND_LETTERS,
    curve_legend,
    explain_marks,
    frame_times,
    picture_title,
    settle,
)
from knotwork.view.motions import Drawable, Motion, chosen, chosen_quantities, motions_of
from knotwork.view.panel import Panel, Series
from knotwork.view.panels import draw_panel, finish_panel
from knotwork.view.style import (
    DASHES,
    SMALL,
    checked_size,
    new_figure,
    printable,
    settings,
    shortened,
)
from knotwork.view.window import WHOLE, Window, windowed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Letters in a line of a row's name.
ROW_LETTERS = 12
# Rows lower than this [in] name quantity and unit below each other.
LOW = 2.0
# So many joints are compared in columns of their own, planners lying over each other.
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

    The curves are evaluated piece by piece, so that jumps are jumps. Waypoints and knots are
    marked. Limits are dashed lines where they are near the curve, and said in words; parts of a
    curve beyond its limit stand out, where the exact extrema break it and nowhere else.

    All joints of one motion share a panel, each in percent of its own limits: a position of half
    its range, from the middle. Where one of them has no limit they share the quantity's unit, and
    no limit is drawn. Curves that lie over each other are said to.

    Several motions lie over each other in a column for each joint if there are at most three
    joints; else each motion has a column of its own.

    Args:
        motions: A `Plan`, a `JointTrajectory`, or several of them.
        joints: Names of the joints to draw; by default all.
        quantities: Of `"position"`, `"velocity"`, `"acceleration"` and `"jerk"`; by default all.
        degrees: Show angles in degrees or in radians; by default as the scenario's file does.
        scenario: For trajectories: what was asked for, to mark waypoints and limits.
        labels: A name for each motion; by default its planner.
        title: Title of the picture; by default the scenario and the planner.
        window: From when to when to draw [s]; `None` for the start or the end of the motion. Use
            of limits is that in the window.
        split: A row of panels a joint instead, a column a quantity, in its unit with its limits.
        size: `"a4"` or `"slide"`; by default as large as the panels need.

    Returns:
        A figure, not known to `pyplot`.

    >>> figure = plot_joints(kw.plan("planar2_closed_form"), quantities=["position", "velocity"])
    >>> [axis.get_ylabel() for axis in figure.axes]
    ['position [% of range]', 'velocity [% of limit]']

    Raises:
        UnknownNameError: There is no such joint, quantity or size.
        InputError: There is nothing to draw, or too much for one picture; the motions are of
            different joints, or not of the scenario's; there is nothing in the window.
    """
    found = windowed(motions_of(motions, scenario=scenario, labels=labels), window)
    names = chosen("joint", joints, found[0].trajectory.joint_names)
    kinds = chosen_quantities(quantities)
    page = checked_size(size)
    with settings():
        rows = _layout(found, names, kinds) if not split else _split(found, names, kinds)
        columns, units = len(rows[0]), found[0].units(degrees)
        figure = new_figure(len(rows), columns, page)
        axes = figure.subplots(len(rows), columns, sharex=True, squeeze=False)
        panels = [
            [Panel(axis, *cell, units) for axis, cell in zip(line, cells, strict=True)]
            for line, cells in zip(axes, rows, strict=True)
        ]
        for line in panels:
            _draw_row(line, len(panels), shared=not split and not _overlaid(panels))
            if split:
                _name_row(line)
        _legends(figure, panels, found, title, joints=not split)
        _frame(figure, panels, found, kinds if split else names, grows=page is None)
    return figure


_Cell = tuple[str, list[Series]]
_Row = list[_Cell]
"""Quantity and curves of each panel."""


def _split(motions: list[Motion], names: list[str], kinds: list[str]) -> list[_Row]:
    """A row a joint and a column a quantity.

    Raises:
        InputError: It is too much for one picture.
    """
    _check_overlaid(motions)
    return [[(kind, _overlay(motions, joint)) for kind in kinds] for joint in names]


def _overlay(motions: list[Motion], joint: str) -> list[Series]:
    """One joint of all motions."""
    alone = len(motions) == 1
    return [
        Series(one, joint, i, i, "" if alone else printable(one.label))
        for i, one in enumerate(motions)
    ]


def _check_overlaid(motions: list[Motion]) -> None:
    if len(motions) > len(DASHES):
        raise InputError(
            f"{len(motions)} motions are too many to tell apart in one picture; choose at most "
            f"{len(DASHES)}"
        )


def _name_row(line: list[Panel]) -> None:
    """Name the joint of a row and the units in it."""
    for panel in line:
        panel.axis.set_ylabel(f"[{panel.unit}]")
    (name,) = shortened([line[0].series[0].joint], MOST_LEGEND_LETTERS)
    parts = textwrap.wrap(name.replace("_", "_ "), ROW_LETTERS, break_long_words=False)
    words = "\n".join(part.replace("_ ", "_") for part in parts)
    line[0].axis.set_ylabel(f"{words}\n[{line[0].unit}]", fontsize=SMALL)


def _layout(motions: list[Motion], names: list[str], kinds: list[str]) -> list[_Row]:
    """Quantity and curves of each panel, row by row.

    Raises:
        InputError: It is too much for one picture.
    """
    if len(motions) == 1 or len(names) > MOST_JOINT_COLUMNS:
        if len(motions) > MOST_MOTION_COLUMNS:
            raise InputError(
                f"{len(motions)} motions of {len(names)} joints are too much for one picture; "
                f"choose at most {MOST_MOTION_COLUMNS} motions, or at most {MOST_JOINT_COLUMNS} "
                "joints"
            )
        return _joints_together(motions, names, kinds)
    _check_overlaid(motions)
    return [[(kind, _overlay(motions, joint)) for joint in names] for kind in kinds]


def _joints_together(motions: list[Motion], names: list[str], kinds: list[str]) -> list[_Row]:
    """A column a motion; where both angles and lengths occur, they have rows of their own."""
    first = motions[0].trajectory
    units = dict(zip(first.joint_names, first.joint_units, strict=True))
    groups = [[name for name in names if units[name] == unit] for unit in ("rad", "m")]
    short = dict(zip(names, shortened(names, MOST_LEGEND_LETTERS), strict=True))
    alone = len(names) == 1
    rows: list[_Row] = []
    for kind in kinds:
        for group in filter(None, groups):
            rows.append(
                [
                    (kind, [_together(motion, name, names, short, alone) for name in group])
                    for motion in motions
                ]
            )
    return rows


def _together(
    motion: Motion, name: str, names: list[str], short: dict[str, str], alone: bool
) -> Series:
    """One of the joints of a panel."""
    i = names.index(name)
    return Series(motion, name, i, i, "" if alone else short[name])


def _draw_row(line: list[Panel], rows: int, *, shared: bool) -> None:
    for panel in line:
        draw_panel(panel)
    low, high = min(panel.low for panel in line), max(panel.high for panel in line)
    for panel in line:
        span = (low, high) if shared else (panel.low, panel.high)
        finish_panel(panel, *span, rows, len(line))
    if shared:
        limits = np.array([panel.axis.get_ylim() for panel in line])
        for panel in line:
            panel.axis.set_ylim(limits.min(), limits.max())
        for panel in line[1:]:
            panel.axis.set_ylabel("")


def _frame(
    figure: Figure,
    panels: list[list[Panel]],
    motions: list[Motion],
    names: list[str],
    *,
    grows: bool,
) -> None:
    """Times below, and the names of waypoints and columns above."""
    titles: list[str] = []
    if len(panels[0]) > 1:
        shared = _overlaid(panels) or len(motions) == 1
        titles = list(names) if shared else [motion.label for motion in motions]
    elif _overlaid(panels):
        titles = list(names)
    tops, bottoms = ([panel.axis for panel in panels[i]] for i in (0, -1))
    if figure.get_size_inches()[1] / len(panels) < LOW:
        for panel in (line[0] for line in panels):
            panel.axis.set_ylabel(panel.axis.get_ylabel().replace(" [", "\n["))
    figure.align_ylabels()
    frame_times(tops, bottoms, motions, titles)
    settle(figure, len(panels), grows=grows)


def _legends(
    figure: Figure,
    panels: list[list[Panel]],
    motions: list[Motion],
    title: str | None,
    *,
    joints: bool,
) -> None:
    """Which curve is which, unless rows say it, and what marks mean."""
    overlaid = _overlaid(panels)
    series = sorted(
        (one for line in panels for panel in line for one in panel.series),
        key=lambda one: one.index,
    )
    curve_legend(
        figure,
        {
            one.motion.label if overlaid else one.joint: (one.index, one.dashed)
            for one in series
            if overlaid or joints
        },
        title if title is not None else picture_title(motions, "joint motions"),
    )
    explain_marks(figure, len(motions) if overlaid else 1)


def _overlaid(panels: list[list[Panel]]) -> bool:
    """Whether several motions share a panel."""
    return len({one.motion.label for one in panels[0][0].series}) > 1
