"""CppFlow's paths: self-motion is chosen over the whole path, and plain Pinocchio judges it."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from judged import judged
from sweeps import mostly_exhaustive

ROOT = Path(__file__).parents[1]
NAMES = ("panda__1cube", "panda__2cubes", "fetch_arm__s")


@pytest.fixture
def problems(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    return importlib.import_module("path_problems")


@pytest.mark.parametrize("name", mostly_exhaustive(NAMES, "panda__2cubes"))
def test_a_path_for_redundant_arms_is_planned_and_proved(name: str, problems: Any) -> None:
    task = problems.problem(name)
    plan = kw.plan(task)
    assert plan.report.ok
    found = {one.quantity: one for one in plan.report.findings if one.group == "Tool paths"}
    assert found["path_deviation"].limit == 1e-4
    assert found["path_orientation"].limit == np.radians(0.1)
    assert all(one.proof == "bounded" for one in found.values())
    assert not judged(plan, task)
