"""Words about limits in a panel: which curve is nearest to its own, or beyond it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from knotwork.verification import Finding
from knotwork.view.panel import Series
from knotwork.view.style import rounded


def limit_note(
    series: Sequence[Series], quantity: str, factor: float, unit: str
) -> tuple[str, bool]:
    """Say what is nearest to its limit, or furthest beyond it.

    Args:
        series: The curves of the panel.
        quantity: What they show.
        factor: From SI to the shown unit.
        unit: The shown unit.

    Returns:
        The words, none where no limit is given, and whether they say that a limit is broken.
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
    if quantity == "position":
        margin = use.margin if use.margin is not None else np.inf
        return f"{name}{rounded(factor * margin)} {unit} inside {limits}", False
    part = 100 * (1 - _room(use, bounds))
    return f"{name}{f'{part:.0f}' if part >= 1 else 'under 1'} % of {limits}", False


def nearest(series: Sequence[Series], quantity: str) -> Series | None:
    """The curve that is nearest to its limit, or furthest beyond; `None` where none is given."""
    given = [one for one in series if (one.joint, quantity) in one.motion.uses]
    return min(
        given,
        key=lambda one: _room(_use(one, quantity), one.motion.bounds(one.joint, quantity)),
        default=None,
    )


def _use(one: Series, quantity: str) -> Finding:
    return one.motion.uses[one.joint, quantity]


def _room(use: Finding, bounds: tuple[float, float]) -> float:
    """Margin in parts of what there is: negative beyond the limit."""
    margin = use.margin if use.margin is not None else np.inf
    half = 0.5 * (bounds[1] - bounds[0])
    return float(margin / half) if np.isfinite(half) else float(margin)


def _limits(bounds: tuple[float, float], factor: float, unit: str, use: Finding) -> str:
    lower, upper = (factor * bound for bound in bounds)
    if lower == -upper:
        return f"limit ±{rounded(upper)} {unit}"
    if use.quantity == "position" and np.isfinite(lower) and np.isfinite(upper):
        return f"limits {rounded(lower)} … {rounded(upper)} {unit}"
    return f"limit {rounded(factor * (use.limit or 0.0))} {unit}"
