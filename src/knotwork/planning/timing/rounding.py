"""Durations in messages, with a margin."""

from __future__ import annotations

from knotwork.units import rounded_up

DURATION_RESERVE = 1e-4
"""Relative margin of a reported duration over a sufficient one."""


def with_room(value: float) -> float:
    """A duration slightly above a feasible one, with few digits.

    >>> with_room(1.3833333)
    1.384
    """
    return rounded_up(value * (1.0 + DURATION_RESERVE), 4)
