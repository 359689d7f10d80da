"""What tests of motions in execution share."""

from __future__ import annotations

import pytest

import knotwork as kw


@pytest.fixture(scope="session")
def deburring() -> kw.Plan:
    task = kw.Task.load("ur5_deburring")
    limits = task.limits.replace(acceleration=150, jerk=1500)
    return kw.plan(task.replace(limits=limits))
