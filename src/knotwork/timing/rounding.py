"""Directed rounding of numbers in messages, so that the statements about them stay true."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context

SPARE = 1e-4
"""Relative margin of a reported duration over a sufficient one."""


def rounded_up(value: float, digits: int = 6) -> float:
    """Round a number up to n digits.

    >>> rounded_up(1.3833333), rounded_up(2.0)
    (1.38334, 2.0)
    """
    return float(Context(prec=digits, rounding=ROUND_CEILING).create_decimal(f"{value:.12g}"))


def rounded_down(value: float, digits: int = 6) -> float:
    """Round a number down to n digits.

    >>> rounded_down(1.3833333, 3), rounded_down(0.0)
    (1.38, 0.0)
    """
    return float(Context(prec=digits, rounding=ROUND_FLOOR).create_decimal(f"{value:.12g}"))


def with_room(value: float) -> float:
    """A duration slightly above a feasible one, in few digits.

    >>> with_room(1.3833333)
    1.384
    """
    return rounded_up(value * (1.0 + SPARE), 4)
