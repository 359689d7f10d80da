"""What docs/planners.md says is what its tables show, and they are what is measured."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from knotwork.comparison import compare

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "planners.md").read_text(encoding="utf-8")
PROSE = " ".join(PAGE.split("**Smooth tasks", 1)[0].split())
KINDS, RATIOS = ("Smooth", "Near", "Arbitrary"), (1, 10, 100)
PAPER, BALANCED = "modified-hermite, paper", "modified-hermite, balanced 0.2"
ESTIMATED = "quintic, estimated"
MEETS = ("modified-hermite", "cubic", "quintic", "septic", "nonic", "bspline-velocity", "3-5-3")

Table = dict[str, dict[str, tuple[float, float]]]


def read_tables() -> dict[tuple[str, int], Table]:
    """Median and worst by kind and ratio, planner and column."""
    tables: dict[tuple[str, int], Table] = {}
    heading = (
        r"\*\*(\w+) tasks, longest : shortest interval (\d+)\*\* \(median / worst of 300\)\n\n"
    )
    for kind, ratio, body in re.findall(heading + r"((?:\|.*\n)+)", PAGE):
        names, _, *rows = [
            [cell.strip() for cell in line.strip("|").split("|")] for line in body.splitlines()
        ]
        tables[kind, int(ratio)] = {
            row[0]: {
                name: tuple(float(part) for part in cell.split(" / "))  # type: ignore[misc]
                for name, cell in zip(names[2:], row[2:], strict=True)
                if cell != "unbounded"
            }
            for row in rows
        }
    return tables


TABLES = read_tables()


def said(pattern: str) -> tuple[float, ...]:
    """Numbers of a sentence of the page."""
    found = re.search(pattern, PROSE)
    assert found, f"the page does not say: {pattern}"
    return tuple(float(group) for group in found.groups())


def column(
    planner: str, name: str, *, kinds: tuple[str, ...] = KINDS, ratios: tuple[int, ...] = RATIOS
) -> tuple[list[float], list[float]]:
    """Medians and worst cases of a planner over tables."""
    cells = [TABLES[kind, ratio][planner][name] for kind in kinds for ratio in ratios]
    return [cell[0] for cell in cells], [cell[1] for cell in cells]


def as_said(figure: float, number: float) -> None:
    """A number is a figure rounded to the digits that are shown."""
    digits = 0 if number >= 10 else len(str(number).split(".")[1].rstrip("0"))
    assert abs(figure - number) <= 0.5 * 10.0**-digits + 1e-9


def test_there_are_all_tables_with_all_planners() -> None:
    assert list(TABLES) == [(kind, ratio) for kind in KINDS for ratio in RATIOS]
    for table in TABLES.values():
        assert len(table) == 15


def test_smooth_tasks() -> None:
    (paper, estimated) = said(r"never more than (\d+) % above .* never more than (\d+) %\.")
    worst = max(column(PAPER, "peak velocity / cubic", kinds=("Smooth",))[1])
    as_said(100 * (worst - 1), paper)
    worst = max(column(ESTIMATED, "peak velocity / cubic", kinds=("Smooth",))[1])
    as_said(100 * (worst - 1), estimated)
    for planner, pattern in (
        ("quintic, zero", r"\(([\d.]+) to ([\d.]+) times the cubic's in the median\)"),
        ("septic, zero", r"`septic` ([\d.]+) to ([\d.]+) times"),
        ("nonic, zero", r"`nonic` ([\d.]+) to ([\d.]+) times"),
    ):
        medians, _ = column(planner, "peak accel. / cubic", kinds=("Smooth",))
        assert said(pattern) == (min(medians), max(medians))


def test_knots_and_uneven_times() -> None:
    arbitrary = said(
        r"velocity is ([\d.]+) times the cubic's in the median and ([\d.]+) times in the worst"
    )
    near = said(r"neighbours suggest ([\d.]+) and ([\d.]+) times\.")
    for kind, numbers in (("Arbitrary", arbitrary), ("Near", near)):
        for figure, number in zip(
            TABLES[kind, 100][PAPER]["peak velocity / cubic"], numbers, strict=True
        ):
            as_said(figure, number)
    (most,) = said(r"c = 0\.2 stay within ([\d.]+) times everywhere")
    as_said(max(column(BALANCED, "peak velocity / cubic")[1]), most)
    (most,) = said(r"same weakness: ([\d.]+) times in its worst case")
    as_said(max(column("3-5-3", "peak velocity / cubic")[1]), most)


def test_jerk_of_balanced_knots() -> None:
    numbers = said(r"jerk is ([\d.]+) times that of the paper's knots .* and ([\d.]+) times in the")
    for figure, number in zip(
        TABLES["Smooth", 100][BALANCED]["peak jerk / paper"], numbers, strict=True
    ):
        as_said(figure, number)
    median, worst = said(r"at most ([\d.]+) times in the median and up to ([\d.]+) times in the w")
    medians, worsts = column(BALANCED, "peak jerk / paper", kinds=("Arbitrary",))
    as_said(max(medians), median)
    as_said(max(worsts), worst)
    for table in TABLES.values():
        small, usual = table["modified-hermite, balanced 0.1"], table[BALANCED]
        assert small["peak velocity / cubic"] <= usual["peak velocity / cubic"]
        assert small["peak jerk / paper"][0] > usual["peak jerk / paper"][0]


def test_acceleration_of_balanced_knots() -> None:
    name = "peak accel. / cubic"
    (most,) = said(r"peak acceleration is at most ([\d.]+) times the cubic's in the worst case")
    as_said(max(column(BALANCED, name)[1]), most)
    (most,) = said(r"that of the paper's knots up to ([\d.]+) times")
    as_said(max(column(PAPER, name)[1]), most)
    paper, balanced = said(r"arbitrary tasks at 100 : 1, ([\d.]+) against ([\d.]+)")
    as_said(TABLES["Arbitrary", 100][PAPER][name][0], paper)
    as_said(TABLES["Arbitrary", 100][BALANCED][name][0], balanced)


def test_what_434_costs_beside_the_spline() -> None:
    least, most, low, high = said(
        r"peak jerk is ([\d.]+) to ([\d.]+) times that of `bspline` in the median, "
        r"its peak acceleration ([\d.]+) to ([\d.]+) times"
    )
    for name, (one, other) in {
        "peak jerk / paper": (least, most),
        "peak accel. / cubic": (low, high),
    }.items():
        pairs = zip(column("4-3-4", name)[0], column("bspline", name)[0], strict=True)
        ratios = [a / b for a, b in pairs]
        as_said(min(ratios), one)
        as_said(max(ratios), other)


def test_the_rival() -> None:
    medians, _ = column(ESTIMATED, "peak accel. / cubic")
    assert said(r"with ([\d.]+) to ([\d.]+) times the plain cubic's peak acceleration") == (
        min(medians),
        max(medians),
    )
    medians, _ = column(ESTIMATED, "∫ jerk² / paper", ratios=(1,))
    assert said(r"squared jerk is ([\d.]+) to ([\d.]+) times") == (min(medians), max(medians))
    medians, _ = column(ESTIMATED, "peak jerk / paper", ratios=(10, 100))
    least, most = said(r"peak jerk is ([\d.]+) to ([\d.]+) times as high in the median")
    as_said(min(medians), least)
    as_said(max(medians), most)


def test_who_is_best_and_worst() -> None:
    for (kind, ratio), table in TABLES.items():
        fluctuation = {name: row["fluctuation"][0] for name, row in table.items()}
        meeting = {name: f for name, f in fluctuation.items() if name.startswith(MEETS)}
        assert fluctuation["cubic"] == min(meeting.values())
        if kind == "Smooth":
            assert fluctuation["trapezoidal"] == max(fluctuation.values())
        if kind != "Arbitrary":
            continue
        if ratio > 1:
            assert fluctuation[PAPER] == max(fluctuation.values())
        for name in ("peak accel. / cubic", "peak jerk / paper"):
            medians = {planner: row[name][0] for planner, row in table.items() if name in row}
            assert set(sorted(medians, key=lambda row: medians[row])[:2]) == {"bspline", "4-3-4"}
    (most,) = said(r"misses positions by up to (\d+) times")
    as_said(max(column("parabolic-blend", "position miss")[1]), most)


def test_time_to_plan() -> None:
    least, most = said(r"to plan\*\*, ([\d.]+) to ([\d.]+) times as long")
    medians = [
        row["time to plan / cubic"][0]
        for table in TABLES.values()
        for name, row in table.items()
        if name.startswith("modified-hermite")
    ]
    as_said(min(medians), least)
    as_said(max(medians), most)


def test_the_ur5() -> None:
    lower, times = said(
        r"deburring UR5 its peak acceleration is (\d+) % lower .* jerk ([\d.]+) times"
    )
    rows = {row.planner: row for row in compare("ur5_deburring").scores}
    own, rival = rows["modified-hermite"], rows["quintic:estimated"]
    as_said(100 * (1 - rival.peak_acceleration.value / own.peak_acceleration.value), lower)
    assert own.peak_jerk is not None
    assert rival.peak_jerk is not None
    as_said(rival.peak_jerk.value / own.peak_jerk.value, times)


@pytest.fixture(scope="module")
def benchmark() -> ModuleType:
    spec = importlib.util.spec_from_file_location("planners", ROOT / "benchmarks" / "planners.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ratio", RATIOS)
def test_the_first_tasks_are_no_worse_than_the_tables_say(
    kind: str, ratio: int, benchmark: ModuleType
) -> None:
    rng = np.random.default_rng([1, KINDS.index(kind), ratio])
    table = TABLES[kind, ratio]
    seen: dict[str, list[float]] = {}
    for _ in range(10):
        waypoints = benchmark.task(rng, kind.lower(), ratio)
        width = np.diff(waypoints.time)
        assert width.max() / width.min() == pytest.approx(ratio, rel=1e-9)
        for planner, figures in benchmark.measure(waypoints).items():
            for name, figure in figures.items():
                if name in table[planner] and not name.startswith("time"):
                    worst = table[planner][name][1]
                    assert figure <= worst * 1.005 + 0.005 + (
                        0.5e5 if worst >= 1e5 else 0.5 * (worst >= 100)
                    )
                    seen.setdefault(f"{planner} {name}", []).append(figure)
    assert max(map(max, seen.values())) > 0.1
