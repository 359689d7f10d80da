"""Time and memory of Knotwork's spline and SciPy's, side by side in one run.

    OPENBLAS_NUM_THREADS=1 python benchmarks/spline.py [--max-n N] [--samples N] [--repeats N]

Building takes waypoints of 6 joints at uneven times. `ModifiedHermiteSpline` and
`CubicHermiteSpline` take positions and velocities, `CubicSpline` and `make_interp_spline`
positions only: they do less. Evaluation takes sorted times spread evenly over the curve. All
contestants take turns within each repetition, and medians are given; ratios are those of the
times taken in the same repetition. Memory is the peak that NumPy allocates while building, with
the result, as `tracemalloc` sees it.
"""

from __future__ import annotations

import functools
import os
import time
import tracemalloc
from collections.abc import Callable, Mapping

import click
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.interpolate import CubicHermiteSpline, CubicSpline, make_interp_spline

from knotwork.arrays import FloatArray
from knotwork.curves.interpolation import ModifiedHermiteSpline

JOINTS = 6
OURS = "ModifiedHermiteSpline"
Task = Callable[[], object]


def waypoints(n: int, joints: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Random waypoints at times of which the longest interval is three times the shortest."""
    rng = np.random.default_rng(n)
    x = np.concatenate(([0.0], np.cumsum(rng.uniform(0.5, 1.5, n - 1))))
    return x, rng.normal(size=(n, joints)), rng.normal(size=(n, joints))


def builders(n: int, joints: int = JOINTS) -> dict[str, Task]:
    """One function each that builds a curve through the same waypoints."""
    x, y, v = waypoints(n, joints)
    return {
        OURS: lambda: ModifiedHermiteSpline(x, y, v),
        "CubicSpline": lambda: CubicSpline(x, y),
        "CubicHermiteSpline": lambda: CubicHermiteSpline(x, y, v),
        "make_interp_spline": lambda: make_interp_spline(x, y, k=3),
    }


def seconds(task: Task, least: float = 0.02) -> float:
    """Mean time of a run, over as many runs as take `least` seconds [s]."""
    runs, start = 0, time.perf_counter()
    while True:
        result = task()
        runs += 1
        passed = time.perf_counter() - start
        if passed >= least:
            return passed / runs
        del result


def measure(tasks: Mapping[str, Task], repeats: int) -> dict[str, FloatArray]:
    """Times of all tasks, taken in turns, shape (repeats,) each [s]."""
    for task in tasks.values():
        task()
    taken = [{name: seconds(task) for name, task in tasks.items()} for _ in range(repeats)]
    return {name: np.array([times[name] for times in taken]) for name in tasks}


def peak_memory(task: Task) -> int:
    """Most memory allocated at a time while a task runs, its result included [bytes]."""
    tracemalloc.start()
    try:
        result = task()
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    del result
    return peak


def table_of_ratios(title: str, unit: str, names: list[str], label: str) -> Table:
    """Build an empty table: the label, a column for each name, our ratio to each of SciPy's."""
    table = Table(title=f"{title} [{unit}]", title_justify="left")
    table.add_column(label, justify="right")
    for name in names:
        table.add_column(name, justify="right")
    for name in names[1:]:
        table.add_column(f"ours / {name}", justify="right", style="bold")
    return table


def add_row(
    table: Table, label: str, values: Mapping[str, FloatArray], scale: float, *more: str
) -> None:
    """Add medians, medians of the ratios taken in the same repetition, and further cells."""
    first, *others = values
    medians = [f"{np.median(taken) * scale:.4g}" for taken in values.values()]
    ratios = [f"{np.median(values[first] / values[other]):.2f}" for other in others]
    table.add_row(label, *medians, *ratios, *more)


def building(console: Console, sizes: list[int], repeats: int) -> None:
    """Time and memory of building, for each number of waypoints."""
    names = list(builders(4))
    times = table_of_ratios(f"Build time, {JOINTS} joints", "ms", names, "waypoints")
    memory = table_of_ratios(f"Peak memory of building, {JOINTS} joints", "MB", names, "waypoints")
    for n in sizes:
        tasks = builders(n)
        add_row(times, f"{n:,}", measure(tasks, repeats), 1e3)
        peaks = {name: np.array([float(peak_memory(task))]) for name, task in tasks.items()}
        add_row(memory, f"{n:,}", peaks, 1e-6)
    console.print(times)
    console.print(memory)


def evaluation(console: Console, sizes: list[int], samples: int, repeats: int) -> None:
    """Time of evaluating the same curve by each library, for each number of waypoints."""
    names = [OURS, "PPoly"]
    title = "Evaluation of one curve: the same polynomials in both"
    table = table_of_ratios(title, "ms", names, "waypoints, samples × joints")
    table.add_column("filling an array", justify="right")
    cases = ((1, samples), (JOINTS, samples // JOINTS), (JOINTS, samples))
    for n in sizes:
        for joints, count in cases:
            ours = ModifiedHermiteSpline(*waypoints(n, joints))
            theirs = ours.to_ppoly()
            t = np.linspace(ours.x[0], ours.x[-1], count)
            tasks: dict[str, Task] = {
                names[0]: functools.partial(ours, t),
                names[1]: functools.partial(theirs, t),
                "fill": functools.partial(np.full, (count, joints), 1.0),
            }
            values = measure(tasks, repeats)
            filled = f"{np.median(values.pop('fill')) * 1e3:.4g}"
            add_row(table, f"{n:,}, {count:,} × {joints}", values, 1e3, filled)
    console.print(table)


@click.command()
@click.option(
    "--max-n",
    default=1_000_000,
    show_default=True,
    type=click.IntRange(min=4),
    help="Most waypoints.",
)
@click.option(
    "--samples",
    default=10_000_000,
    show_default=True,
    type=click.IntRange(min=JOINTS),
    help="Samples taken of each curve.",
)
@click.option(
    "--repeats",
    default=7,
    show_default=True,
    type=click.IntRange(min=1),
    help="Repetitions, of which the median counts.",
)
def main(max_n: int, samples: int, repeats: int) -> None:
    """Compare building and evaluating Knotwork's spline with SciPy's.

    6 joints; waypoints from 4 to --max-n in powers of ten.
    """
    console = Console(width=160)  # columns are not cut short where the output is piped
    if os.environ.get("OPENBLAS_NUM_THREADS") != "1":
        console.print("OPENBLAS_NUM_THREADS is not 1: the libraries may use several threads")
    sizes = [n for n in (4, 10, 100, 1_000, 10_000, 100_000, 1_000_000) if n < max_n] + [max_n]
    building(console, sizes, repeats)
    evaluation(console, [n for n in sizes if n in (4, 100, 10_000, max_n)], samples, repeats)


if __name__ == "__main__":
    main()
