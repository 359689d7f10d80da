"""Joint position, velocity, acceleration and jerk over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.errors import InputError
from knotwork.joint_quantities import MOTION_QUANTITIES, rate_unit
from knotwork.task.scenario import Scenario
from knotwork.units import Units
from knotwork.verification import Finding
from knotwork.verification.limits import limit_slack
from knotwork.verification.report import AnyMotion
from knotwork.view.curves import strokes
from knotwork.view.panel import LimitLine, Panel
from knotwork.view.picture import CURVE_LETTERS, DrawPanel, draw_picture, picture_title
from knotwork.view.plotted_motions import choose_names, motions_of
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.style import DARK, colour, printable, rounded_text, shorten_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_KNOT_TICKS, MAX_LARGE_MARKS = 400, 60
"""Numbers of marks above which knots are left out, and other marks are small to show the curve."""
MAX_KNOT_ROWS = 3
"""Maximum number of motions whose knots are drawn, each in its own row."""
MAX_COLUMNS = 8
"""Maximum number of joints in a picture of several motions."""


@dataclass(frozen=True)
class Series:
    """One joint of one motion in a panel, and its style.

    Attributes:
        motion: The motion.
        joint: Name of the joint.
        index: Index of colour and line style.
        label: Name of the curve in the panel; empty if it is the only one.
    """

    motion: ShownMotion
    joint: str
    index: int
    label: str

    @property
    def component(self) -> int:
        """Index of the joint in the motion."""
        return self.motion.trajectory.joint_names.index(self.joint)

    @property
    def unit(self) -> str:
        """SI unit of the joint's position."""
        return self.motion.trajectory.joint_units[self.component]

    def finding(self, quantity: str) -> Finding | None:
        """Finding on the joint's limit of a quantity; `None` without a limit."""
        return self.motion.joint_limit_findings.get((self.joint, quantity))

    def margin(self, quantity: str) -> float:
        """Margin to a limit as a fraction of half the range; negative beyond it."""
        finding = self.finding(quantity)
        margin = finding.margin if finding is not None and finding.margin is not None else 0.0
        lower, upper = self.motion.bounds(self.joint, quantity)
        return float(margin / (0.5 * (upper - lower))) if np.isfinite(upper - lower) else margin


def plot_joints(
    motions: AnyMotion | Sequence[AnyMotion],
    *,
    joints: Sequence[str] | None = None,
    quantities: Sequence[str] | None = None,
    degrees: bool | None = None,
    scenario: Scenario | None = None,
    size: str | None = None,
) -> Figure:
    """Draw joint motions over time, one row of panels per quantity.

    Joints of one motion share a panel, which shows the limits of the joint nearest to its limits.
    Several motions have one column per joint. Jumps, waypoints and knots are marked, and so are
    parts of curves beyond a limit.

    Args:
        motions: A `Plan`, a `JointTrajectory`, or several of them.
        joints: Names of the joints to draw; by default all.
        quantities: Some of `"position"`, `"velocity"`, `"acceleration"`, `"jerk"`; default all.
        degrees: Show angles in degrees or in radians; by default the unit of the scenario.
        scenario: Scenario of trajectories, to mark waypoints and limits.
        size: `"a4"` or `"slide"`; by default as large as the panels need.

    >>> figure = plot_joints(kw.plan("planar2_closed_form"), quantities=["position", "velocity"])
    >>> len(figure.axes)
    2

    Raises:
        InputError: A name is unknown, no curve or too many curves would be drawn, or joints differ.
    """
    drawn = motions_of(motions, scenario)
    names = choose_names("joint", joints, drawn[0].trajectory.joint_names)
    kinds = choose_names("quantity", quantities, MOTION_QUANTITIES)
    heading = picture_title(drawn, "joint motions")

    def panel(kind: str, series: list[Series]) -> DrawPanel:
        return partial(_joint_panel, quantity=kind, series=series, units=drawn[0].units(degrees))

    if len(drawn) == 1:
        groups = _joints_by_unit(drawn[0], names)
        rows = [[panel(kind, series)] for kind in kinds for series in groups]
        return draw_picture(drawn, rows, heading, joints=names, size=size)
    if len(names) > MAX_COLUMNS:
        raise InputError(
            f"{len(names)} joints of {len(drawn)} motions do not fit into one picture; accepted: "
            f"at most {MAX_COLUMNS} joints"
        )
    columns = [_overlaid(drawn, name) for name in names]
    rows = [[panel(kind, series) for series in columns] for kind in kinds]
    return draw_picture(drawn, rows, heading, columns=names, size=size)


def _overlaid(motions: list[ShownMotion], joint: str) -> list[Series]:
    """One joint of all motions."""
    return [Series(motion, joint, i, printable(motion.label)) for i, motion in enumerate(motions)]


def _joints_by_unit(motion: ShownMotion, names: list[str]) -> list[list[Series]]:
    """The joints of one motion: those with angles, and those with lengths."""
    short = shorten_names(names, CURVE_LETTERS) if len(names) > 1 else [""]
    series = [Series(motion, name, i, short[i]) for i, name in enumerate(names)]
    groups = ([item for item in series if item.unit == unit] for unit in ("rad", "m"))
    return [group for group in groups if group]


def _joint_panel(axes: Axes, quantity: str, series: Sequence[Series], units: Units) -> Panel:
    """Draw the panel of a quantity.

    The limits shown are those of the joint nearest to its limit, and have its colour if another
    joint has other limits.

    Args:
        axes: Axes to draw on.
        quantity: Name of the quantity.
        series: The curves, of joints with one unit.
        units: Displayed units.
    """
    first, order = series[0], MOTION_QUANTITIES.index(quantity)
    factor, unit = units.shown(1.0, rate_unit(first.unit, order))
    panel = Panel(axes, quantity, unit, factor)
    for item in series:
        _draw_curve(panel, item, len(series))
    panel.mark_waypoints(first.motion.times)
    motions = {item.motion.label: item for item in series}
    if order < 2:
        _mark_given(panel, series, order, one_motion=len(motions) == 1)
    for row, item in enumerate(motions.values() if len(motions) <= MAX_KNOT_ROWS else ()):
        if len(item.motion.curve.x) <= MAX_KNOT_TICKS:
            shade = DARK if len(motions) == 1 else colour(item.index)
            panel.mark_knots(row, item.motion.curve.x, shade)
    pairs = ((item, item.finding(quantity)) for item in series)
    findings = {item: finding for item, finding in pairs if finding is not None}
    if findings:
        nearest = min(findings, key=lambda item: item.margin(quantity))
        bounds = nearest.motion.bounds(nearest.joint, quantity)
        span = [(float(first.motion.curve.x[0]), float(first.motion.curve.x[-1]))]
        alike = {item.motion.bounds(item.joint, quantity) for item in series} == {bounds}
        one_curve = None if alike else colour(nearest.index)
        panel.levels = [LimitLine("limit", factor * end, span, colour=one_curve) for end in bounds]
        panel.note, panel.failed = _limit_note(nearest, findings, panel)
    return panel


def _draw_curve(panel: Panel, series: Series, count: int) -> None:
    """Draw one of `count` curves, its jumps and, if the check fails, its parts beyond the limit."""
    motion, quantity, factor = series.motion, panel.title, panel.factor
    drawn = strokes(motion.curve, series.component, MOTION_QUANTITIES.index(quantity), factor)
    name = f"{motion.label}:{series.joint}:{quantity}"
    panel.draw_curve(name, series.index, *drawn.line(steps=quantity == "jerk"))
    if quantity != "jerk":
        marker = "o" if drawn.jumps.size * count <= MAX_LARGE_MARKS else ""
        panel.mark("jump", name, *drawn.jump_lines(), color=colour(series.index), marker=marker)
    finding = series.finding(quantity)
    if finding is not None and not finding.ok:
        lower, upper = (
            factor * (bound + sign * limit_slack(bound))
            for bound, sign in zip(motion.bounds(series.joint, quantity), (-1, 1), strict=True)
        )
        panel.mark("exceeded", name, *drawn.beyond(lower, upper))


def _mark_given(panel: Panel, series: Sequence[Series], order: int, *, one_motion: bool) -> None:
    """Mark the given values at the waypoints, once for each joint."""
    for item in {item.joint: item for item in reversed(series)}.values():
        times, value = item.motion.times, item.motion.given_values[order][:, item.component]
        is_known = np.isfinite(value)
        look: dict[str, Any] = {"ms": 6.0 if len(times) * len(series) <= MAX_LARGE_MARKS else 3.5}
        look |= {"mec": colour(item.index)} if one_motion else {}
        panel.mark("given", item.joint, times[is_known], panel.factor * value[is_known], **look)


def _limit_note(nearest: Series, findings: dict[Series, Finding], panel: Panel) -> tuple[str, bool]:
    """Text on the curve nearest to its limit or farthest beyond; whether a limit is exceeded."""
    factor, unit, finding = panel.factor, panel.unit, findings[nearest]
    name = f"{nearest.label}: " if nearest.label else ""
    lower, upper = (factor * bound for bound in nearest.motion.bounds(nearest.joint, panel.title))
    if lower == -upper:
        limits = f"limit ±{rounded_text(upper)} {unit}"
    elif np.isfinite([lower, upper]).all():
        limits = f"limits {rounded_text(lower)} … {rounded_text(upper)} {unit}"
    else:
        limits = f"limit {rounded_text(factor * (finding.limit or 0.0))} {unit}"
    value = finding.value or 0.0
    peak = rounded_text(factor * value) if np.isfinite(value) else "a jump"
    exceeded = sum(not item.ok for item in findings.values())
    others = f", and {exceeded - 1} more exceeded" if exceeded > 1 else ""
    proof = ", sampled only" if finding.only_sampled else ""
    return (
        f"{name}{peak} at {rounded_text(finding.time or 0.0)} s, {limits}{others}{proof}",
        exceeded > 0,
    )
