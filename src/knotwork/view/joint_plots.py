"""Joint position, velocity, acceleration and jerk over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from knotwork.errors import InputError
from knotwork.joint_quantities import DERIVATIVES
from knotwork.task.scenario import Scenario
from knotwork.view.headings import CURVE_LETTERS, picture_title, write_around
from knotwork.view.joint_panels import Series, joint_panel
from knotwork.view.panel import finish_panel, new_axes, new_figure, page_size
from knotwork.view.plotted_motions import choose_names, motions_of
from knotwork.view.shown_motion import Drawable, ShownMotion
from knotwork.view.style import printable, settings, shorten_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_COLUMNS = 8
"""Largest number of joints of several motions in one picture."""


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
    motions have one column per joint. Jumps, waypoints and knots are marked, and the parts of
    curves whose exact extrema exceed a limit.

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
    kinds = choose_names("quantity", quantities, DERIVATIVES)
    page, units = page_size(size), drawn[0].units(degrees)
    several = len(drawn) > 1
    rows = _overlaid(drawn, names, kinds) if several else _joints_together(drawn[0], names, kinds)
    curves = [motion.label for motion in drawn] if several else names
    titles = names if several else [""]
    with settings():
        figure = new_figure(len(rows), len(titles), page)
        grid = new_axes(figure, len(rows), len(titles))
        for line, row in zip(grid, rows, strict=True):
            for axes, (kind, series) in zip(line, row, strict=True):
                finish_panel(joint_panel(axes, kind, series, units))
        heading = picture_title(drawn, "joint motions") if title is None else title
        write_around(figure, drawn, heading, curves, titles=titles, grows=page is None)
    return figure


_Row = list[tuple[str, list[Series]]]
"""Quantity and curves of each panel."""


def _overlaid(motions: list[ShownMotion], names: list[str], kinds: list[str]) -> list[_Row]:
    """One column per joint, with all motions.

    Raises:
        InputError: There is too much for one picture.
    """
    if len(names) > MAX_COLUMNS:
        raise InputError(
            f"{len(names)} joints of {len(motions)} motions are too much for one picture; choose "
            f"at most {MAX_COLUMNS} joints"
        )
    labels = [printable(motion.label) for motion in motions]

    def joint_series(name: str) -> list[Series]:
        pairs = zip(motions, labels, strict=True)
        return [Series(motion, name, i, label) for i, (motion, label) in enumerate(pairs)]

    return [[(kind, joint_series(name)) for name in names] for kind in kinds]


def _joints_together(motion: ShownMotion, names: list[str], kinds: list[str]) -> list[_Row]:
    """One column, with separate rows for angles and lengths."""
    trajectory = motion.trajectory
    units = dict(zip(trajectory.joint_names, trajectory.joint_units, strict=True))
    short = shorten_names(names, CURVE_LETTERS) if len(names) > 1 else [""]
    of_unit = [[i for i, name in enumerate(names) if units[name] == unit] for unit in ("rad", "m")]
    return [
        [(kind, [Series(motion, names[i], i, short[i]) for i in group])]
        for kind in kinds
        for group in of_unit
        if group
    ]
