"""What a test plans is judged by the judge too: it shares nothing with Knotwork."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import knotwork as kw
from judge.motion import Motion
from judge.task import Task
from judge.verdict import Wrong, judge


def judged(plan: kw.Plan, given: Path | dict[str, Any]) -> list[Wrong]:
    """What the judge finds in a plan, from the scenario's file or mapping.

    Nothing if the plan failed its own check: it is not passed off as right.
    """
    if not plan.report.ok:
        return []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plan.save(folder)
        numbers = folder / "scenario.yaml"  # where times were free
        if numbers.exists():
            given = numbers
        task = Task.read(given) if isinstance(given, Path) else Task(given, folder)
        return judge(task, Motion.read(folder / "trajectory.json"))
