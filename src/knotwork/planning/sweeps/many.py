"""`kw.plan_many`: plans of many scenarios, in several processes."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from knotwork.errors import InputError, KnotworkError, PlanningCrashError, format_value
from knotwork.errors.arguments import require_count, require_number, require_type
from knotwork.planning import Plan, plan
from knotwork.planning.sweeps.child import Child, map_in_children, refuse_changed_checks
from knotwork.planning.sweeps.run import DEFAULT_TIME_LIMIT
from knotwork.task import Task
from knotwork.task.scenario import Scenario


def plan_many(
    scenarios: Iterable[str | Path | Mapping[str, Any] | Task | Scenario],
    *,
    workers: int | None = None,
    time_limit: float = DEFAULT_TIME_LIMIT,
) -> list[Plan | KnotworkError]:
    """Plan and check many scenarios, in several processes of this machine.

    Args:
        scenarios: Scenarios, each as for `knotwork.plan`.
        workers: Number of processes; by default as many as there are processors.
        time_limit: Time limit of one scenario [s].

    Returns:
        For each scenario its plan, or the error of `knotwork.plan`, or a `PlanningTimeoutError` or
            `PlanningCrashError` of `knotwork.errors`.

    Raises:
        InputError: You have checks of your own, or the number of workers, the time limit or the
            type of a scenario is wrong.

    >>> lift = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 1}]
    >>> good, bad = kw.plan_many([{"waypoints": lift}, "no_such_task"], workers=1)
    >>> good.report.ok, type(bad).__name__
    (True, 'UnknownNameError')
    """
    count = require_count(os.cpu_count() or 1 if workers is None else workers, "workers", 1)
    refuse_changed_checks("use kw.plan")
    limit = require_number(time_limit, "time_limit", "s", positive=True)
    kinds = (str, Path, Mapping, Task, Scenario)
    if isinstance(scenarios, kinds) or not isinstance(scenarios, Iterable):
        accepted = "a list of names, paths, mappings, tasks or scenarios"
        raise InputError(f"scenarios is {format_value(scenarios)}; accepted: {accepted}")
    tasks = list(scenarios)
    for i, task in enumerate(tasks):
        require_type(task, kinds, f"scenarios[{i}]", "a name, path, mapping, task or scenario")

    def plan_in(child: Child, i: int) -> tuple[int, Plan | KnotworkError]:
        try:
            return i, child.call(plan, tasks[i], limit=limit)
        except KnotworkError as error:
            return i, error
        except Exception as error:  # a fault in one scenario does not stop the others
            return i, PlanningCrashError(f"internal error: {type(error).__name__}: {error}")

    plans = dict(map_in_children(plan_in, range(len(tasks)), min(count, max(1, len(tasks)))))
    return [plans[i] for i in range(len(tasks))]
