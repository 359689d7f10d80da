"""Sweeps: rows a second, one process and two, what Dask takes, and memory.

The study is a grid of placements of the block of `ur5_deburring`. It is made by two processes; a
coarser grid is made by one, by two, and by two workers of Dask. Times of the processor are measured
apart, so that a machine with other work disturbs them little: those of the processes that plan, and
those of all others (this one, Dask's scheduler and workers, writing the files). Rates are by the
clock, and ratios of them mean something on a quiet machine only.

From these figures the script works out what a study of a million rows takes with Dask.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click
import psutil
from loky.backend import popen_loky_posix
from rich.console import Console

import knotwork as kw
import results
from results import Table

MANY = 1_000_000
"""Number of rows of the study that is estimated."""


@dataclass
class Run:
    """What one run of the study took.

    Attributes:
        rows: Number of rows.
        seconds: By the clock, from the first row that was finished to the last.
        planning: Time of the processor of the processes that plan [s].
        others: That of all other processes [s].
        memory: Memory of all processes when a tenth of the rows was finished, and in the end [MB].
        size: Of the files [bytes].
    """

    rows: int = 0
    seconds: float = 0.0
    planning: float = 0.0
    others: float = 0.0
    memory: list[float] = field(default_factory=list)
    size: int = 0

    @property
    def rate(self) -> float:
        """Rows a second by the clock."""
        return self.rows / self.seconds

    @property
    def overhead(self) -> float:
        """Time of all other processes, in that of those that plan."""
        return self.others / self.planning


def usage() -> tuple[float, float, float]:
    """Times of the processor of those that plan and of all others [s], and memory of all [MB]."""
    planning = others = memory = 0.0
    own = psutil.Process()
    for process in (own, *own.children(recursive=True)):
        try:
            times, used = process.cpu_times(), process.memory_info().rss / 1e6
            plans = popen_loky_posix.__name__ in process.cmdline()
        except psutil.Error:
            continue
        memory += used
        if plans:
            planning += times.user + times.system
        else:
            others += times.user + times.system
    return planning, others, memory


def measured(
    vary: dict[str, str],
    folder: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
) -> Run:
    """Make the study by some workers, and measure from its first finished row to its last."""
    run, begin = Run(), (0.0, 0.0, 0.0)

    def watch(at: kw.sweeps.SweepProgress) -> None:
        nonlocal begin
        if at.done == 1:
            begin = (*usage()[:2], time.perf_counter())
        if at.done >= at.total / 10 and not run.memory:
            run.memory.append(usage()[2])
        if at.done == at.total:
            planning, others, memory = usage()
            run.planning, run.others = planning - begin[0], others - begin[1]
            run.seconds = time.perf_counter() - begin[2]
            run.rows = at.total - 1
            run.memory.append(memory)

    kw.sweep(
        "ur5_deburring", vary, out=folder, progress=watch, workers=workers, scheduler=scheduler
    )
    run.size = (folder / "rows.jsonl").stat().st_size
    return run


def central_cost(folder: Path) -> float:
    """Time of the processor of all but planning for a row [s], of which there are many here."""
    ends = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 1}]
    begin: list[float] = []

    def watch(at: kw.sweeps.SweepProgress) -> None:
        if at.done in (50, at.total):
            begin.append(usage()[1])

    with cluster(1) as scheduler:
        kw.sweep(
            {"waypoints": ends},
            {"waypoints[1].after": "1:2:450"},
            out=folder,
            scheduler=scheduler,
            progress=watch,
        )
    return (begin[1] - begin[0]) / 400


def estimate(run: Run, central: float) -> str:
    """What a million rows take with Dask.

    Args:
        run: With two workers of Dask.
        central: Time of the processor of all but planning for a row [s].
    """
    row, size = run.planning / run.rows, MANY * run.size / run.rows
    return (
        f"{MANY} rows on paper: {MANY * row / 3600:.1f} h of processors that plan and "
        f"{MANY * central / 3600:.1f} h of the one that hands them out, which so keeps "
        f"{row / central:.0f} of them busy; {size / 1e6:.0f} MB"
    )


def placements(rows: int) -> dict[str, str]:
    """What is varied, for about so many rows."""
    angles = max(2, round((rows * 36 / 41) ** 0.5))
    return {
        "frames.block.position[0]": f"250:650:{max(2, round(rows / angles))}",
        "frames.block.rpy[2]": f"0:{360 - 360 / angles:g}:{angles}",
    }


@click.command()
@click.option("--rows", default=10_000, help="Rows of the study of two processes, about.")
@click.option("--compared", default=640, help="Rows of the studies that are compared, about.")
@results.save_option
def main(rows: int, compared: int, save: Path | None) -> None:
    """Measure sweeps."""
    vary, runs = placements(compared), dict[str, Run]()
    with tempfile.TemporaryDirectory() as folder:
        runs["1 process"] = measured(vary, Path(folder) / "one", workers=1)
        runs["2 processes"] = measured(vary, Path(folder) / "two", workers=2)
        with cluster(2) as scheduler:
            runs["Dask, 2 workers"] = measured(vary, Path(folder) / "dask", scheduler=scheduler)
        if rows > compared:
            runs["2 processes, all"] = measured(placements(rows), Path(folder) / "all", workers=2)
        alone = without_time(Path(folder) / "one")
        for name in ("two", "dask"):
            if without_time(Path(folder) / name) != alone:
                raise click.ClickException(f"the rows of {name} differ")
        central = central_cost(Path(folder) / "light")
    load = os.getloadavg()[0]
    table = Table(
        "Placements of ur5_deburring",
        (
            "",
            "rows",
            "rows a s",
            "planning [ms a row]",
            "others [%]",
            "memory, at 10 % and in the end [MB]",
        ),
        [
            [
                name,
                f"{run.rows}",
                f"{run.rate:.2f}",
                f"{1e3 * run.planning / run.rows:.0f}",
                f"{100 * run.overhead:.1f}",
                " ".join(f"{value:.0f}" for value in run.memory),
            ]
            for name, run in runs.items()
        ],
        note=f"(load of the machine {load:.1f})",
    )
    console = Console(width=120)
    table.show(console)
    scaling = runs["2 processes"].rate / runs["1 process"].rate
    console.print(f"from 1 to 2 processes: {scaling:.2f} times the rows a second")
    console.print(estimate(runs["Dask, 2 workers"], central))
    if save is not None:
        data = {name: vars(run) for name, run in runs.items()}
        results.save(save, "sweep", {"load": load, "scaling": scaling, "central": central, **data})


def without_time(folder: Path) -> list[dict[str, Any]]:
    """The rows of a study without the one column that differs between runs."""
    return [{**row, "plan_time": None} for row in kw.Study.open(folder).rows()]


@contextmanager
def cluster(workers: int) -> Iterator[str]:
    """Run a Dask cluster of this machine; its address."""
    import distributed

    local: Any = distributed.LocalCluster
    with local(
        n_workers=workers, threads_per_worker=1, dashboard_address=":0", silence_logs=50
    ) as made:
        yield made.scheduler_address


if __name__ == "__main__":
    main()
