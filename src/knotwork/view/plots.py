"""Joint position, velocity, acceleration and jerk over time."""

from __future__ import annotations

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
    new_figure,
    printable,
    settings,
    shortened,
)
from knotwork.view.window import WHOLE, Window, windowed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# So many joints are compared in columns of their own, planners lying over each other.
MOST_JOINT_COLUMNS = 3
# With more joints each planner has a column of its own.
MOST_MOTION_COLUMNS = 4


def plot_joints(
    motions: Drawable | Sequence[Drawable],
    *,
    joints: Sequence[str] | None = None,
    quantities: Sequence[str] | None = None,
    degrees: bool = False,
    scenario: Scenario | None = None,
    labels: Sequence[str] | None = None,
    title: str | None = None,
    window: Window = WHOLE,
) -> Figure:
    """Draw joint motions over time, a row of panels a quantity.

    The curves are evaluated piece by piece, so that jumps are jumps. Waypoints and knots are
    marked. Limits are dashed lines where they are near the curve, and said in words; parts of a
    curve beyond its limit stand out, where the exact extrema break it and nowhere else.

    All joints of one motion share a panel. Several motions lie over each other in a column for
    each joint if there are at most three joints; else each motion has a column of its own.

    Args:
        motions: A `Plan`, a `JointTrajectory`, or several of them.
        joints: Names of the joints to draw; by default all.
        quantities: Of `"position"`, `"velocity"`, `"acceleration"` and `"jerk"`; by default all.
        degrees: Show angles in degrees instead of radians.
        scenario: For trajectories: what was asked for, to mark waypoints and limits.
        labels: A name for each motion; by default its planner.
        title: Title of the picture; by default the scenario and the planner.
        window: From when to when to draw [s]; `None` for the start or the end of the motion. Use
            of limits is that in the window.

    Returns:
        A figure, not known to `pyplot`.

    >>> figure = plot_joints(kw.plan("planar2_closed_form"), quantities=["position", "velocity"])
    >>> [axis.get_ylabel() for axis in figure.axes]
    ['position [rad]', 'velocity [rad/s]']

    Raises:
        UnknownNameError: There is no such joint or quantity.
        InputError: There is nothing to draw, or too much for one picture; the motions are of
            different joints, or not of the scenario's; there is nothing in the window.
    """
    found = windowed(motions_of(motions, scenario=scenario, labels=labels), window)
    names = chosen("joint", joints, found[0].trajectory.joint_names)
    kinds = chosen_quantities(quantities)
    with settings():
        rows = _layout(found, names, kinds)
        columns = len(rows[0][1])
        figure = new_figure(len(rows), columns)
        axes = figure.subplots(len(rows), columns, sharex=True, squeeze=False)
        panels = [
            [Panel(axis, kind, series, degrees) for axis, series in zip(line, cells, strict=True)]
            for line, (kind, cells) in zip(axes, rows, strict=True)
        ]
        for line in panels:
            _draw_row(line, len(panels), shared=not _overlaid(panels))
        _legends(figure, panels, found, title)
        _frame(figure, panels, found, names)
    return figure


_Row = tuple[str, list[list[Series]]]


def _layout(motions: list[Motion], names: list[str], kinds: list[str]) -> list[_Row]:
    """Quantity and panels of each row, and the curves of each panel.

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
    if len(motions) > len(DASHES):
        raise InputError(
            f"{len(motions)} motions are too many to tell apart in one picture; choose at most "
            f"{len(DASHES)}"
        )
    cells = [
        [Series(motion, joint, i, i, printable(motion.label)) for i, motion in enumerate(motions)]
        for joint in names
    ]
    return [(kind, cells) for kind in kinds]


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
            cells = [
                [
                    Series(motion, name, i, i // 7, "" if alone else short[name])
                    for name in group
                    for i in [names.index(name)]
                ]
                for motion in motions
            ]
            rows.append((kind, cells))
    return rows


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
    figure: Figure, panels: list[list[Panel]], motions: list[Motion], names: list[str]
) -> None:
    """Times below, and the names of waypoints and columns above."""
    titles: list[str] = []
    if len(motions) > 1:
        titles = list(names) if _overlaid(panels) else [motion.label for motion in motions]
    tops, bottoms = ([panel.axis for panel in panels[i]] for i in (0, -1))
    figure.align_ylabels()
    frame_times(tops, bottoms, motions, titles)
    settle(figure, len(panels))


def _legends(
    figure: Figure, panels: list[list[Panel]], motions: list[Motion], title: str | None
) -> None:
    overlaid = _overlaid(panels)
    series = sorted(
        (one for line in panels for panel in line for one in panel.series),
        key=lambda one: one.index,
    )
    curve_legend(
        figure,
        {one.motion.label if overlaid else one.joint: (one.index, one.dashed) for one in series},
        title if title is not None else picture_title(motions, "joint motions"),
    )
    explain_marks(figure, len(motions) if overlaid else 1)


def _overlaid(panels: list[list[Panel]]) -> bool:
    """Whether several motions share a panel."""
    return len({one.motion.label for one in panels[0][0].series}) > 1
