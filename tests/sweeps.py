"""What `make test` leaves to `make test-all`: most of a sweep's cases, most random examples."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import settings

ALL_EXAMPLES = "exhaustive"
"""The Hypothesis profile of `make test-all`."""


def first_of(few: Any, many: Any) -> list[Any]:
    """Two cases for `parametrize`, such as sizes of a sweep: the second in `make test-all` only.

    A tuple holds the values of several names.
    """
    values = many if isinstance(many, tuple) else (many,)
    return [few, pytest.param(*values, marks=pytest.mark.exhaustive)]


def mostly_exhaustive(values: Iterable[Any], *ordinary: Any) -> list[Any]:
    """Cases for `parametrize`, of which `make test` runs the ordinary ones only.

    A tuple holds the values of several names.
    """
    known = list(values)
    assert set(ordinary) <= set(known), f"not among the cases: {set(ordinary) - set(known)}"
    rows = {value: value if isinstance(value, tuple) else (value,) for value in known}
    return [
        value if value in ordinary else pytest.param(*rows[value], marks=pytest.mark.exhaustive)
        for value in known
    ]


def examples(count: int = 20, in_all: int = 240) -> settings:
    """Settings of a Hypothesis test: random examples in `make test`, and in `make test-all`."""
    every = settings.get_current_profile_name() == ALL_EXAMPLES
    return settings(max_examples=in_all if every else count)
