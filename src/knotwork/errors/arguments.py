"""Checks of numbers, flags and types that a caller gives."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any

import numpy as np

from knotwork.errors import InputError, format_value


def require_number(
    value: Any,
    subject: str,
    unit: str = "",
    *,
    positive: bool = False,
    minimum: float = -math.inf,
) -> float:
    """Check a number, and return it as a float.

    Args:
        value: The given value. `True` and text are not numbers.
        subject: Name of the quantity, for the error.
        unit: Its unit, for the error.
        positive: Require a value above 0.
        minimum: Smallest accepted value.

    Raises:
        InputError: The value is not a number, not finite, not positive where required, or below
            the minimum.
    """
    number = math.nan
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        with suppress(OverflowError):  # an integer beyond the range of floats
            number = float(value)
    if not math.isfinite(number) or (positive and number <= 0.0):
        kind = "positive and finite number" if positive else "finite number"
        in_unit = f" [{unit}]" if unit else ""
        raise InputError(f"{subject} is {format_value(value)}; it must be a {kind}{in_unit}")
    if number < minimum:
        raise InputError(f"{subject} is {format_value(value)}; it must be at least {minimum:g}")
    return number


def require_count(value: Any, subject: str, minimum: float = -math.inf) -> int:
    """Check a whole number, and return it.

    Args:
        value: The given value.
        subject: Name of the number, for the error.
        minimum: Smallest accepted number.

    Raises:
        InputError: The value is not a whole number, or below the minimum.
    """
    if not isinstance(value, int | np.integer) or isinstance(value, bool):
        raise InputError(f"{subject} is {format_value(value)}; it must be a whole number")
    if value < minimum:
        raise InputError(f"{subject} is {value}; it must be at least {minimum}")
    return int(value)


def require_type(value: Any, types: Any, subject: str, accepted: str) -> None:
    """Refuse a value of another type.

    Args:
        value: The given value.
        types: The accepted type or types, as for `isinstance`.
        subject: Name of the value, for the error.
        accepted: Accepted values, for the error.

    Raises:
        InputError: The value has another type.
    """
    if not isinstance(value, types):
        raise InputError(f"{subject} is {format_value(value)}; accepted: {accepted}")


def require_flag(value: Any, subject: str) -> bool:
    """Check a flag, and return it as a bool.

    Args:
        value: The given value. Text, such as "no", is refused.
        subject: Name of the flag, for the error.

    Raises:
        InputError: The value is neither `True` nor `False`.
    """
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{subject} is {format_value(value)}; it must be True or False")
    return bool(value)
