"""The command `knotwork compare`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from knotwork.cli import tables
from knotwork.cli.parameters import (
    FAILED,
    PASSED,
    folder_option,
    json_option,
    names_option,
    package_path_option,
)
from knotwork.cli.progress_display import show_planning
from knotwork.cli.terminal import echo, echo_json
from knotwork.curves.interpolation import PLANNER_SPECS, rules
from knotwork.planning.comparison import Comparison, Refusal, Score, best
from knotwork.planning.comparison import compare as compare_planners
from knotwork.units import readable
from knotwork.verification.metrics import Peak

_COLUMNS = {
    "position_miss": "pos.\nmiss",
    "velocity_miss": "vel.\nmiss",
    "acceleration_jump": "accel.\njump",
    "peak_velocity": "peak\nvel.",
    "peak_acceleration": "peak\naccel.",
    "peak_jerk": "peak\njerk",
    "tool_path_deviation": "off path\n[{length}]",
}
"""Headings by figure."""
FIGURE_ROUNDING, SMALL_FIGURE = 1e-9, 0.01
"""Size below which figures are rounding errors, and below which they are shown with two digits."""


@click.command()
@click.argument("scenario")
@names_option(
    "--planners",
    "Planners to compare, separated by commas; all by default. A rule may follow a colon: "
    "septic:estimated.",
)
@folder_option("Write comparison.json and comparison.csv there.")
@package_path_option
@json_option
def compare(scenario: str, planners: list[str] | None, out: Path | None, as_json: bool) -> int:
    """Plan SCENARIO with several planners and compare the motions.

    A planner passes if no check fails; the exit code is 1 if none passes. Joint values are in the
    units of the scenario, or in rad and m if there are angles and lengths. A peak is that of
    the joint nearest its limit, in percent of the limit; without limits it is the largest.
    Where the acceleration jumps, the jerk is unbounded. A star marks the best of each column among
    planners that pass, and those within 1 % of it. Times are chosen once, for all planners.
    --json and --out give more figures.
    """
    with show_planning(scenario, as_json):
        comparison = compare_planners(scenario, planners)
    written = comparison.save(out) if out is not None else []
    if as_json:
        echo_json(comparison.to_dict())
    else:
        print_comparison(comparison)
        for path in written:
            echo(f"wrote {path}")
    return PASSED if any(score.passed for score in comparison.scores) else FAILED


@click.command()
@json_option
def planners(as_json: bool) -> None:
    """List the planners: their guarantees, limitations, options and rules."""
    rows = [asdict(spec) for spec in PLANNER_SPECS.values()]
    for row in rows:
        del row["entry_point"]
        row["rules"] = rules(row["name"])
    if as_json:
        echo_json(rows)
        return
    for row in rows:
        tables.print_entry(
            row["name"],
            f"degree {row['degree']}, C{row['continuity']}",
            {
                "meets": row["guarantees"],
                "limitations": row["limitations"],
                "options": ", ".join(row["supports"]),
                "rules": ", ".join(f"{row['name']}:{rule}" for rule in row["rules"]),
            },
        )


def print_comparison(comparison: Comparison) -> None:
    """Print the table of a comparison, followed by the failures and refusals."""
    scores, units = comparison.scores, comparison.units
    joint_factor, joint_unit = _joint_unit(comparison)
    factors = dict.fromkeys(_COLUMNS, joint_factor)
    factors["tool_path_deviation"] = units.shown(1.0, "m")[0]
    shown = [name for name in _COLUMNS if any(getattr(row, name) is not None for row in scores)]
    headings = [_COLUMNS[name].format(length=units.length) for name in shown]
    duration = f": {scores[0].duration:g} s" if scores else ""
    title = f"{comparison.scenario}{duration}"
    table = tables.plain_table(title, ["planner", "verdict", *headings], 2)
    table.padding = (0, 0, 0, 0)  # cells end in a star or a space
    winners, above = best(scores), ""
    for row in comparison.rows:
        planner, _, rule = row.planner.partition(":")
        label = f"  :{rule}" if rule and planner == above else row.planner
        above = planner
        if isinstance(row, Refusal):
            table.add_row(label, "refused: see below")
            continue
        stars = ["*" if row.planner in winners.get(name, ()) else " " for name in shown]
        cells = [_cell(row, name, factors[name]) for name in shown]
        verdict = "passed" if row.passed else f"{row.failed} fail"
        table.add_row(label, verdict, *map("".join, zip(cells, stars, strict=True)))
    tables.print_table(table)
    echo(f"\n{joint_unit}, s; % of the limit; * best of all that pass")
    if comparison.times_chosen:
        echo("Times were chosen once, for all planners.")
        echo("modified-hermite without a rule is the chosen motion.")
    for row in comparison.rows:
        if row.reason:
            verdict = "refused" if isinstance(row, Refusal) else "fails"
            tables.print_wrapped(row.reason, f"{row.planner} {verdict}: ", "    ", "red")


def _joint_unit(comparison: Comparison) -> tuple[float, str]:
    """Factor from SI to the unit of the joints' figures, and that unit."""
    kinds = {unit for motion in comparison.trajectories.values() for unit in motion.joint_units}
    if len(kinds) != 1:
        return 1.0, "rad or m"
    return comparison.units.shown(1.0, kinds.pop())


def _cell(score: Score, name: str, factor: float) -> str:
    """A figure in the shown unit, or a peak in percent of its limit."""
    value = getattr(score, name)
    if value is None:
        return "inf" if name == "peak_jerk" else "-"  # where the acceleration jumps
    if isinstance(value, Peak) and value.utilisation is not None:
        percent = 100 * value.utilisation
        return f"{percent:.0f} %" if percent >= 10 else f"{percent:.2g} %"
    size = factor * (value.value if isinstance(value, Peak) else value)
    if abs(size) < FIGURE_ROUNDING:
        return "0"
    return readable(size, ".3g" if abs(size) >= SMALL_FIGURE else ".1e")
