"""Limits in a panel: lines, bands, the parts of curves beyond them, and a note on the tightest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from knotwork.verification import Finding
from knotwork.verification.limits import LIMIT_SLACK
from knotwork.view.curves import Strokes
from knotwork.view.panel import Panel, Series
from knotwork.view.style import LOOKS, WRONG, rounded
from knotwork.waypoints import FloatArray

# A limit further off the curves than this, in parts of their range, is a note and no line: it
# would squash them.
NEAR = 0.35
# The band is this narrow where there are more stretches than this, so that they stay apart.
MOST_WIDE_STRETCHES, NARROW = 8, 5.0


def draw_broken(panel: Panel, one: Series, drawn: Strokes) -> None:
    """Highlight the parts of a curve beyond its limit by a broad band, and the worst by a cross.

    Nothing is drawn unless the exact extrema break the limit.
    """
    use = one.motion.uses.get((one.joint, panel.quantity))
    if use is None or use.ok:
        return
    factor, offset = panel.scale(one)
    lower, upper = (
        factor * (bound + sign * LIMIT_SLACK * max(1.0, abs(bound))) + offset
        for bound, sign in zip(one.motion.bounds(one.joint, panel.quantity), (-1, 1), strict=True)
    )
    time, value = drawn.beyond(lower, upper)
    stretches = np.count_nonzero(np.isnan(value[:-1]) & np.isfinite(value[1:]))
    found = use.value or 0.0
    worst = found if np.isfinite(found) else use.limit  # a jump is marked at the limit
    look = LOOKS["broken"]
    if stretches > MOST_WIDE_STRETCHES:
        look = look | {"linewidth": NARROW}
    panel.axis.plot(time, value, gid=panel.gid("broken", one), zorder=2.5, **look)
    at = [use.time or 0.0], [factor * (worst or 0.0) + offset]
    panel.axis.plot(*at, gid=panel.gid("worst", one), zorder=5, **LOOKS["worst"])


def draw_limits(panel: Panel, low: float, high: float) -> tuple[float, float]:
    """Draw the limits that are near the curves as dashed lines.

    Joints that share a panel share its lines, at the whole of their own limits. Where one of them
    has no limit there are none: one joint's limit would seem to be that of all.

    Args:
        panel: Where.
        low: Least of the values shown.
        high: Greatest of them.

    Returns:
        The range, the limits drawn included.
    """
    span = high - low
    lines: dict[float, str] = {}
    for one in panel.series if panel.one_joint or panel.percent else ():
        if (one.joint, panel.quantity) not in one.motion.uses:
            continue
        factor, offset = panel.scale(one)
        for bound in one.motion.bounds(one.joint, panel.quantity):
            limit = factor * bound + offset
            if panel.percent:
                limit = float(np.sign(limit)) * 100.0  # of all joints, without rounding
            if low - NEAR * span <= limit <= high + NEAR * span:
                lines.setdefault(limit, one.joint if panel.one_joint else "all")
    for limit, whose in lines.items():
        low, high = min(low, limit), max(high, limit)
        gid = f"limit:{whose}:{panel.quantity}"
        panel.axis.axhline(limit, gid=gid, zorder=2, **LOOKS["limit"])
    return low, high


def draw_bands(panel: Panel, bottom: float, top: float) -> None:
    """Shade the panel beyond the limits of its only joint.

    Args:
        panel: Where.
        bottom: Least value that the panel shows.
        top: Greatest of them. The band goes on far above, for the top to be raised.
    """
    one = panel.series[0]
    lower, upper = (panel.factor * bound for bound in one.motion.bounds(one.joint, panel.quantity))
    far = 10.0 * (top - bottom)
    bands = []
    if bottom < lower:
        bands.append((bottom - far, lower))
    if upper < top:
        bands.append((upper, top + far))
    for start, end in bands:
        panel.axis.axhspan(start, end, color=WRONG, alpha=0.07, lw=0, zorder=0, gid="band")


# Curves nearer to each other than this at all times looked at, in parts of the panel's range, are
# seen as one.
SAMPLES, SAME = 400, 0.006
MOST_NAMES = 3


def limit_note(
    series: Sequence[Series], quantity: str, factor: float, unit: str
) -> tuple[str, bool]:
    """Name the curve nearest to its limit, or furthest beyond it.

    Args:
        series: The curves of the panel.
        quantity: Theirs.
        factor: From SI to the shown unit.
        unit: The shown unit.

    Returns:
        The note, empty where no limit is given, and whether a limit is broken.
    """
    first = nearest(series, quantity)
    if first is None:
        return "", False
    use, bounds = _use(first, quantity), first.motion.bounds(first.joint, quantity)
    uses = [one.motion.uses.get((one.joint, quantity)) for one in series]
    broken = sum(one is not None and not one.ok for one in uses)
    name = f"{first.who}: " if first.who else ""
    limits = _limits(bounds, factor, unit, use)
    if broken:
        more = f", and {broken - 1} more beyond" if broken > 1 else ""
        worst = use.value or 0.0
        value = rounded(factor * worst)
        if np.isinf(worst):
            value = f"a jump, infinite {quantity},"
        return f"{name}{value} at {rounded(use.time or 0.0)} s breaks {limits}{more}", True
    if use.only_sampled:
        value = rounded(factor * (use.value or 0.0))
        return f"{name}{value} at {rounded(use.time or 0.0)} s, sampled only: {limits}", False
    if quantity == "position":
        margin = use.margin if use.margin is not None else np.inf
        return f"{name}{rounded(factor * margin)} {unit} inside {limits}", False
    part = 100 * (1 - _margin(use, bounds))
    return f"{name}{f'{part:.0f}' if part >= 1 else 'under 1'} % of {limits}", False


def coinciding(panel: Panel) -> list[str]:
    """Name the curves of a panel that lie over each other."""
    if len(panel.series) < 2 or not panel.high > panel.low:
        return []
    starts = [one.motion.curve.x[0] for one in panel.series]
    ends = [one.motion.curve.x[-1] for one in panel.series]
    time = np.linspace(max(starts), min(ends), SAMPLES)
    least = SAME * (panel.high - panel.low)
    groups: list[tuple[FloatArray, list[str]]] = []
    for one in panel.series:
        factor, offset = panel.scale(one)
        value = factor * one.motion.curve(time, panel.order)[:, one.component] + offset
        names = next((names for other, names in groups if _near(value, other, least)), None)
        if names is None:
            groups.append((value, [one.who]))
        else:
            names.append(one.who)
    return [f"{_listed(names)} lie over each other" for _, names in groups if len(names) > 1]


def _near(one: FloatArray, other: FloatArray, least: float) -> bool:
    return float(np.abs(one - other).max()) < least


def _listed(names: Sequence[str]) -> str:
    """A list of names; the last of many are counted."""
    if len(names) > MOST_NAMES:
        return f"{', '.join(names[:MOST_NAMES])} and {len(names) - MOST_NAMES} more"
    return f"{', '.join(names[:-1])} and {names[-1]}"


def nearest(series: Sequence[Series], quantity: str) -> Series | None:
    """The curve that is nearest to its limit, or furthest beyond; `None` where none is given."""
    given = [one for one in series if (one.joint, quantity) in one.motion.uses]
    return min(
        given,
        key=lambda one: _margin(_use(one, quantity), one.motion.bounds(one.joint, quantity)),
        default=None,
    )


def _use(one: Series, quantity: str) -> Finding:
    return one.motion.uses[one.joint, quantity]


def _margin(use: Finding, bounds: tuple[float, float]) -> float:
    """Margin in parts of half the range: negative beyond the limit."""
    margin = use.margin if use.margin is not None else 0.0  # none is known where it is sampled
    half = 0.5 * (bounds[1] - bounds[0])
    return float(margin / half) if np.isfinite(half) else float(margin)


def _limits(bounds: tuple[float, float], factor: float, unit: str, use: Finding) -> str:
    lower, upper = (factor * bound for bound in bounds)
    if lower == -upper:
        return f"limit ±{rounded(upper)} {unit}"
    if use.quantity == "position" and np.isfinite(lower) and np.isfinite(upper):
        return f"limits {rounded(lower)} … {rounded(upper)} {unit}"
    return f"limit {rounded(factor * (use.limit or 0.0))} {unit}"
