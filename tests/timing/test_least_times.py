"""Least times: every given value met to rounding, every limit kept, no motion below the bound."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from timing_cases import assert_kept, random_problem

from knotwork.timing import solve


def problems() -> Iterator[tuple[int, int, int]]:
    rng = np.random.default_rng(5)
    for seed in range(12):
        yield seed, int(rng.integers(2, 9)), int(rng.integers(1, 8))


@pytest.mark.parametrize(("seed", "n", "d"), list(problems()))
def test_random_tasks_are_solved_and_keep_all(seed: int, n: int, d: int) -> None:
    problem = random_problem(seed, n, d)
    assert_kept(problem, solve(problem))
