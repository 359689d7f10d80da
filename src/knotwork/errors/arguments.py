"""Checks of the numbers and choices that a caller gives."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from knotwork.errors import InputError, shown


def finite_number(value: Any, what: str, unit: str = "", *, positive: bool = False) -> float:
    """Return a number as a float.

    Args:
        value: What was given. `True` and text are no numbers.
        what: What it is, for the error.
        unit: Its unit, for the error.
        positive: It must be above 0.

    Raises:
        InputError: It is no number, not finite, or not positive where it must be.
    """
    number = math.nan
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:  # an integer beyond all floats
            number = math.nan
    if not math.isfinite(number) or (positive and number <= 0.0):
        kind = "positive and finite number" if positive else "finite number"
        of = f" [{unit}]" if unit else ""
        raise InputError(f"{what} is {shown(value)}; it must be a {kind}{of}")
    return number


def flag(value: Any, what: str) -> bool:
    """Return a choice of yes or no as a bool.

    Args:
        value: What was given. Text, such as "no", is neither.
        what: What it is, for the error.

    Raises:
        InputError: It is neither `True` nor `False`.
    """
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{what} is {shown(value)}; it must be True or False")
    return bool(value)
