"""Tables and figures of what the benchmark of planners measured."""

from __future__ import annotations

from typing import Any

from results import Table

KINDS = ("smooth", "near", "arbitrary")
RATIOS = (1, 10, 100)
# The figures with a table on the page, and its title; the saved results have all figures.
SHOWN = {
    "peak velocity / cubic": "Peak velocity, relative to the cubic",
    "peak accel. / cubic": "Peak acceleration, relative to the cubic",
    "peak jerk / paper": "Peak jerk, relative to the paper's knots",
    "∫ jerk² / paper": "Integral of squared jerk, relative to the paper's knots",
    "time to plan / cubic": "Time to plan, relative to the cubic",
}
Data = dict[str, Any]


def rounded(value: float) -> float:
    """Keep the digits that are shown: two after the point, none where there are three before it.

    What is below 1e-9 is rounding, and an integer 0; what only rounds to zero is 0.0.
    """
    if value < 1e-9:
        return 0
    return float(f"{value:.2f}" if value < 100 else f"{value:.0f}" if value < 1e5 else f"{value:g}")


def short(value: float) -> str:
    """Write a rounded value."""
    if isinstance(value, int):
        return str(value)
    return f"{value:.2f}" if value < 100 else f"{value:.0f}" if value < 1e5 else f"{value:.0e}"


def tables(data: Data) -> list[Table]:
    """Median and worst of each figure: a table for each, with a column for each case of tasks."""
    cells = {(row["planner"], row["kind"], row["ratio"]): row["figures"] for row in data["rows"]}
    planners = list(dict.fromkeys(planner for planner, _, _ in cells))
    cases = [(kind, ratio) for kind in KINDS for ratio in RATIOS]
    return [
        Table(
            title,
            ("planner", *(f"{kind} {ratio}:1" for kind, ratio in cases)),
            [
                [
                    named(planner, data),
                    *(_cell(cells[planner, kind, ratio][figure]) for kind, ratio in cases),
                ]
                for planner in planners
            ],
            note=f"(median / worst of {data['tasks']})",
        )
        for figure, title in SHOWN.items()
    ]


def _cell(figure: list[float] | None) -> str:
    return "unbounded" if figure is None else " / ".join(map(short, figure))


def named(planner: str, data: Data) -> str:
    """A planner, and on how many tasks of each kind it was measured if not on all."""
    few = data["first"].get(planner)
    return planner if few is None else f"{planner} (first {few})"


def number(value: float) -> str:
    """Write a number in a sentence."""
    return f"{value:.0f}" if value >= 10 else f"{value:.1f}" if value >= 5 else f"{value:.2f}"


class Figures:
    """Figures that sentences quote from the tables, over all tasks or those of a kind or ratio."""

    def __init__(self, data: Data) -> None:
        self.rows = data["rows"]

    def cells(
        self, planner: str, figure: str, kind: str | None = None, ratio: int | None = None
    ) -> list[tuple[float, float]]:
        """Median and worst of a planner, by table."""
        return [
            tuple(row["figures"][figure])
            for row in self.rows
            if row["planner"] == planner
            and kind in (None, row["kind"])
            and ratio in (None, row["ratio"])
        ]

    def worst(self, *which: Any, **tasks: Any) -> str:
        """Worst case of all."""
        return number(max(worst for _, worst in self.cells(*which, **tasks)))

    def percent_above(self, *which: Any, **tasks: Any) -> str:
        """How far the worst case is above 1 [%]."""
        return f"{100 * (max(worst for _, worst in self.cells(*which, **tasks)) - 1):.0f}"

    def median(self, *which: Any, **tasks: Any) -> str:
        """Largest median."""
        return number(max(median for median, _ in self.cells(*which, **tasks)))

    def medians(self, *which: Any, **tasks: Any) -> str:
        """Range of the medians."""
        return span([median for median, _ in self.cells(*which, **tasks)])

    def beside(self, planner: str, other: str, figure: str) -> str:
        """Range of the ratio of two planners' medians."""
        pairs = zip(self.cells(planner, figure), self.cells(other, figure), strict=True)
        return span([a / b for (a, _), (b, _) in pairs])

    def time_to_plan(self, family: str) -> str:
        """Range of the median times of planners whose names begin so, relative to the cubic."""
        figure = "time to plan / cubic"
        return span([r["figures"][figure][0] for r in self.rows if r["planner"].startswith(family)])


def span(values: list[float]) -> str:
    """Write a range."""
    return f"{number(min(values))} to {number(max(values))}"
