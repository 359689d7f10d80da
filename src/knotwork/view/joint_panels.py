"""Panels of joints: curves of one quantity with given values, knots, jumps and limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.joint_quantities import DERIVATIVES, rate_unit
from knotwork.units import Units
from knotwork.verification import Finding
from knotwork.verification.limits import LIMIT_SLACK
from knotwork.view.curves import strokes
from knotwork.view.drawn_motions import Motion
from knotwork.view.panel import Curve, Level, Panel
from knotwork.view.style import DARK, colour, rounded

# More of these would hide the curve; each is small if a panel has more marks.
MOST_KNOT_TICKS, MOST_LARGE_MARKS = 400, 60
# Number of motions up to which each has its own row of knots.
MOST_KNOT_ROWS = 3


@dataclass(frozen=True)
class Series:
    """One joint of one motion in a panel, and its style.

    Attributes:
        motion: The motion.
        joint: Its joint.
        index: Index of colour and line style.
        who: Its name in the panel; empty if it is the only one.
    """

    motion: Motion
    joint: str
    index: int
    who: str

    @property
    def component(self) -> int:
        """Index of the joint in the motion."""
        return self.motion.trajectory.joint_names.index(self.joint)

    def use(self, quantity: str) -> Finding | None:
        """Use of the limit of a quantity; `None` without a limit."""
        return self.motion.uses.get((self.joint, quantity))

    def margin(self, quantity: str) -> float:
        """Margin to a limit as a fraction of half the range; negative beyond it."""
        use = self.use(quantity)
        margin = use.margin if use is not None and use.margin is not None else 0.0
        lower, upper = self.motion.bounds(self.joint, quantity)
        return float(margin / (0.5 * (upper - lower))) if np.isfinite(upper - lower) else margin


def joint_panel(quantity: str, series: Sequence[Series], units: Units) -> Panel:
    """Make the panel of a quantity.

    Joints that share the panel are drawn with the limits of the joint nearest to its limit, in its
    colour if another joint has others.

    Args:
        quantity: Name of the quantity.
        series: The curves, of joints with one unit.
        units: Displayed units.
    """
    first, order = series[0], DERIVATIVES.index(quantity)
    own = first.motion.trajectory.joint_units[first.component]
    factor, unit = units.shown(1.0, rate_unit(own, order))
    one_joint = len({one.joint for one in series}) == 1
    curves = [_curve(one, quantity, factor, len(series)) for one in series]
    marks = first.motion.marks
    panel = Panel(quantity, unit, factor, curves, np.empty(0) if marks is None else marks.time)
    motions = {one.motion.label: one for one in series}
    if order < 2:
        _mark_asked(panel, series, factor, order, alone=len(motions) == 1)
    if len(motions) <= MOST_KNOT_ROWS:
        panel.knots = [
            (one.motion.knots, DARK if len(motions) == 1 else colour(one.index))
            for one in motions.values()
            if len(one.motion.knots) <= MOST_KNOT_TICKS
        ]
    nearest = _nearest(series, quantity)
    if nearest is not None:
        bounds = nearest.motion.bounds(nearest.joint, quantity)
        span = [(float(first.motion.curve.x[0]), float(first.motion.curve.x[-1]))]
        alike = {one.motion.bounds(one.joint, quantity) for one in series} == {bounds}
        index = None if alike else nearest.index
        panel.levels = [Level("limit", factor * float(one), span, index=index) for one in bounds]
        if one_joint:
            panel.allowed = factor * bounds[0], factor * bounds[1]
        panel.note, panel.broken = _limit_note(nearest, series, quantity, factor, unit)
    return panel


def _curve(one: Series, quantity: str, factor: float, count: int) -> Curve:
    """A curve, its jumps, and its parts beyond the limit, the worst with a cross.

    Parts are only marked if the exact extrema exceed the limit.
    """
    motion, order = one.motion, DERIVATIVES.index(quantity)
    drawn = strokes(motion.curve, one.component, order, factor)
    name = f"{motion.label}:{one.joint}:{quantity}"
    made = Curve(name, one.index, *drawn.line(steps=quantity == "jerk"))
    if quantity != "jerk":
        marker = "o" if drawn.jumps.size * count <= MOST_LARGE_MARKS else ""
        made.mark("jump", *drawn.jump_lines(), color=colour(one.index), marker=marker)
    use = one.use(quantity)
    if use is not None and not use.ok:
        lower, upper = (
            factor * (bound + sign * LIMIT_SLACK * max(1.0, abs(bound)))
            for bound, sign in zip(motion.bounds(one.joint, quantity), (-1, 1), strict=True)
        )
        made.mark("broken", *drawn.beyond(lower, upper))
        found = use.value or 0.0
        worst = found if np.isfinite(found) else use.limit  # a jump is marked at the limit
        value = factor * (worst or 0.0)
        made.mark("worst", np.array([use.time or 0.0]), np.array([value]))
    return made


def _mark_asked(
    panel: Panel, series: Sequence[Series], factor: float, order: int, *, alone: bool
) -> None:
    """Mark the given values at the waypoints, once for each joint."""
    large = len(panel.waypoints) * len(series) <= MOST_LARGE_MARKS
    seen: set[str] = set()
    for made, one in zip(panel.curves, series, strict=True):
        marks = one.motion.marks
        if marks is not None and one.joint not in seen:
            seen.add(one.joint)
            value = factor * marks.asked[order][:, one.component]
            known = np.isfinite(value)
            look: dict[str, Any] = {"ms": 6.0 if large else 3.5}
            look |= {"mec": colour(one.index)} if alone else {}
            made.mark("asked", marks.time[known], value[known], **look)


def _nearest(series: Sequence[Series], quantity: str) -> Series | None:
    """The curve nearest to its limit, or furthest beyond it; `None` without limits."""
    limited = [one for one in series if one.use(quantity) is not None]
    return min(limited, key=lambda one: one.margin(quantity), default=None)


def _limit_note(
    first: Series, series: Sequence[Series], quantity: str, factor: float, unit: str
) -> tuple[str, bool]:
    """Name the curve nearest to its limit, or furthest beyond it; and whether one is beyond."""
    uses = [use for one in series if (use := one.use(quantity)) is not None]
    use = first.use(quantity) or uses[0]
    name = f"{first.who}: " if first.who else ""
    limits = _limits(first.motion.bounds(first.joint, quantity), factor, unit, use)
    value = f"{rounded(factor * (use.value or 0.0))} at {rounded(use.time or 0.0)} s"
    broken = sum(not one.ok for one in uses)
    if broken:
        more = f", and {broken - 1} more beyond" if broken > 1 else ""
        if np.isinf(use.value or 0.0):
            value = f"a jump, infinite {quantity}, at {rounded(use.time or 0.0)} s"
        return f"{name}{value} exceeds {limits}{more}", True
    if use.only_sampled:
        return f"{name}{value}, sampled only: {limits}", False
    if quantity == "position":
        margin = use.margin if use.margin is not None else np.inf
        return f"{name}{rounded(factor * margin)} {unit} inside {limits}", False
    part = 100 * (1 - first.margin(quantity))
    return f"{name}{f'{part:.0f}' if part >= 1 else 'under 1'} % of {limits}", False


def _limits(bounds: tuple[float, float], factor: float, unit: str, use: Finding) -> str:
    lower, upper = (factor * bound for bound in bounds)
    if lower == -upper:
        return f"limit ±{rounded(upper)} {unit}"
    if use.quantity == "position" and np.isfinite([lower, upper]).all():
        return f"limits {rounded(lower)} … {rounded(upper)} {unit}"
    return f"limit {rounded(factor * (use.limit or 0.0))} {unit}"
