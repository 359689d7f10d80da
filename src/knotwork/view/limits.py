"""Limits in a panel: dashed lines, shaded bands, and the parts of curves beyond them."""

from __future__ import annotations

import numpy as np

from knotwork.verification.limits import LIMIT_SLACK
from knotwork.view.curves import Strokes
from knotwork.view.panel import Panel, Series
from knotwork.view.style import LOOKS, WRONG

# A limit further off the curves than this, in parts of their range, is a note and no line: it
# would squash them.
NEAR = 0.35
# The band is this narrow where there are more stretches than this, so that they stay apart.
MOST_WIDE_STRETCHES, NARROW = 8, 5.0


def draw_broken(panel: Panel, one: Series, drawn: Strokes) -> None:
    """Highlight what of a curve is beyond its limit: a broad band, and a cross at the worst.

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
    """Shade what is beyond those limits of a panel's only joint that it shows.

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
