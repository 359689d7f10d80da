"""`kw.sweep`: start or continue a study."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from knotwork.errors import InputError
from knotwork.errors.arguments import require_count, require_flag, require_number, require_type
from knotwork.planning.sweeps import executors
from knotwork.planning.sweeps.child import refuse_changed_checks
from knotwork.planning.sweeps.field_path import scenario_with
from knotwork.planning.sweeps.folder import StudyFolder, create, is_study, reopen
from knotwork.planning.sweeps.outcome import ROW_PASSED
from knotwork.planning.sweeps.spec import StudySpec, scenario_document
from knotwork.planning.sweeps.study import Study
from knotwork.planning.sweeps.variations import make_axes
from knotwork.task import Task
from knotwork.task.scenario import Scenario

DEFAULT_TIME_LIMIT = 60.0
"""Default time limit of a row [s]."""


@dataclass(frozen=True)
class SweepProgress:
    """Progress of a sweep.

    >>> progress = kw.sweeps.SweepProgress(done=30, total=90, passed=12, before=10, seconds=4.0)
    >>> progress.rate, progress.left
    (5.0, 12.0)

    Attributes:
        done: Number of finished rows.
        total: Number of rows of the study.
        passed: Number of finished rows that pass.
        before: Number of rows that were finished when the sweep began, as it resumes a study.
        seconds: Elapsed time [s].
    """

    done: int
    total: int
    passed: int
    before: int
    seconds: float

    @property
    def rate(self) -> float:
        """Number of finished rows per second of this sweep."""
        return (self.done - self.before) / self.seconds if self.seconds else 0.0

    @property
    def left(self) -> float | None:
        """Expected remaining time [s]; `None` before the first row is finished."""
        return (self.total - self.done) / self.rate if self.rate else None


def sweep(
    scenario: str | Path | Mapping[str, Any] | Task | Scenario,
    vary: Mapping[str, Any] | None = None,
    *,
    rows: str | Path | None = None,
    together: bool = False,
    samples: int | None = None,
    seed: int = 0,
    out: str | Path | None = None,
    resume: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    stop_after: int | None = None,
    time_limit: float = DEFAULT_TIME_LIMIT,
    progress: Callable[[SweepProgress], None] | None = None,
) -> Study:
    """Plan and check a scenario with varied values, one row per combination.

    A timeout or crash is reported by its row, except with `workers=0`. The results do not depend on
    the number of workers, except for `plan_time`.

    Args:
        scenario: As for `knotwork.plan`.
        vary: Values by the path of the field in the file, such as `waypoints[pick].after`: a list
            or array of values in the file's units, or text, such as `"-200:200:41"` (a range and
            its count), `"paper,balanced"` or `"uniform(-50, 50)"`.
        rows: A CSV file with paths as headings; each row is one variation.
        together: Vary all values together, row by row, in place of their product.
        samples: Number of random samples of the `uniform` values, which vary together.
        seed: Seed of the random numbers.
        out: Folder for the study; by default only in memory.
        resume: Continue the study in the folder.
        workers: Number of child processes, by default one per processor; with 0, rows are planned
            in this process without a time limit.
        scheduler: Address of a Dask scheduler, in place of `workers`.
        stop_after: Stop after this many passing rows.
        time_limit: Time limit of a row [s].
        progress: Callback for finished rows.

    Raises:
        InputError: An argument is wrong, you have checks of your own and `workers` is not 0, the
            folder has another study or can't be written to, or a package is missing.

    >>> lift = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 1}]
    >>> task = {"limits": {"velocity": 1.2}, "waypoints": lift}
    >>> kw.sweep(task, {"waypoints[1].after": "1:2:3", "rate": [100, 200]}, workers=0).reasons
    {'velocity': 2}
    """
    workers = _checked_workers(workers, scheduler)
    require_flag(resume, "resume")
    if stop_after is not None:
        require_count(stop_after, "stop_after", 1)
    limit = require_number(time_limit, "time_limit", "s", positive=True)
    axes = make_axes(vary or {}, rows=rows, together=together, samples=samples, seed=seed)
    spec = StudySpec(scenario_document(scenario), axes, limit)
    _refuse_wrong_values(spec)
    folder = _folder(spec, out, resume)
    _plan_missing(folder, workers, scheduler, progress, stop_after or math.inf)
    return Study(folder)


def _checked_workers(workers: int | None, scheduler: str | None) -> int:
    """Return the number of child processes, which a scheduler makes irrelevant."""
    if scheduler is not None and workers is not None:
        raise InputError("workers and scheduler are both given; give one of the two")
    count = require_count(os.cpu_count() or 1 if workers is None else workers, "workers", 0)
    if scheduler is not None or count:
        refuse_changed_checks("give workers=0 to plan in this process")
    if scheduler is not None:
        executors.distributed()
    return count


def _folder(spec: StudySpec, out: str | Path | None, resume: bool) -> StudyFolder:
    """The study's folder, created or continued."""
    require_type(out, str | Path | None, "out", "the path of a folder")
    if out is None:
        if resume:
            raise InputError("there is no study to continue: resume is given without out")
        return StudyFolder(None, spec)
    return reopen(Path(out), spec) if resume and is_study(out) else create(Path(out), spec)


def _plan_missing(
    folder: StudyFolder,
    workers: int,
    scheduler: str | None,
    progress: Callable[[SweepProgress], None] | None,
    stop_after: float,
) -> None:
    """Plan the unfinished rows until `stop_after` rows pass; each outcome is kept at once."""
    spec = folder.spec
    begin = time.monotonic()
    before = len(folder.rows)
    passed = sum(row["verdict"] == ROW_PASSED for row in folder.rows.values())
    missing = [row for row in range(len(spec)) if row not in folder.rows]
    if passed >= stop_after or not missing:
        return
    with closing(executors.plan_rows(spec, missing, workers, scheduler)) as results:  # type: ignore[type-var]
        for row, outcome in results:
            folder.add(row, outcome)
            passed += outcome.verdict == ROW_PASSED
            if progress is not None:
                seconds = time.monotonic() - begin
                progress(SweepProgress(len(folder.rows), len(spec), passed, before, seconds))
            if passed >= stop_after:
                return


def _refuse_wrong_values(spec: StudySpec) -> None:
    """Refuse a study whose first, middle and last row all have wrong values.

    Raises:
        InputError: The values of these rows are wrong; the message is that of the first row.
    """
    faults: list[InputError] = []
    for row in (0, len(spec) // 2, len(spec) - 1):
        try:
            scenario_with(spec.document, spec.edits(row))
            return
        except InputError as error:
            faults.append(error)
    pairs = zip(spec.paths, spec.values(0), strict=True)
    faults[0].locate(f"with {', '.join(f'{path} = {value!r}' for path, value in pairs)}")
    raise faults[0]
