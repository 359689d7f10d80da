"""The command `knotwork tradeoff`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from knotwork.cli.parameters import FAILED, PASSED, Listed, NewPath, Seconds, json_option
from knotwork.cli.progress import shown_progress
from knotwork.cli.terminal import echo
from knotwork.units import readable

if TYPE_CHECKING:
    from knotwork.tradeoffs import Tradeoff, TradeoffPoint


@click.command()
@click.argument("scenario")
@click.option(
    "--factors",
    type=Listed(float),
    metavar="A,B,…",
    help="Durations in least times, divided by commas, each at least 1.",
)
@click.option(
    "--out",
    "-o",
    metavar="DIR",
    type=NewPath(),
    help="Write tradeoff.json and tradeoff.csv there.",
)
@click.option(
    "--plot",
    "picture",
    metavar="FILE",
    type=NewPath(),
    help="Draw the curve: PNG, SVG or PDF, by the suffix.",
)
@click.option(
    "--budget",
    metavar="TIME",
    type=Seconds(),
    help="Time that choosing has for all durations together, for example 20s.",
)
@json_option
def tradeoff(
    scenario: str,
    factors: list[float] | None,
    out: Path | None,
    picture: Path | None,
    budget: float | None,
    as_json: bool,
) -> int:
    """Show what the least time of SCENARIO is traded for.

    The motion is planned for several durations, from the least one on: at each with the least
    integral of torques squared, or without a robot of jerk squared; where that motion fails its
    check, one in which jerk counts more takes its place. Shown are that integral, the peak torque
    and the peak jerk, each of the joint nearest its limit. The exit code is 1 if one of the
    motions fails its check.
    """
    from knotwork import tradeoffs as curves

    if picture is not None:
        from knotwork.view.files import checked_picture_path

        checked_picture_path(picture)
    tried = factors if factors is not None else curves.FACTORS
    with shown_progress(scenario, as_json) as progress:
        curve = curves.tradeoff(scenario, tried, budget=budget, progress=progress)
    written = curve.save(out) if out is not None else []
    if picture is not None:
        from knotwork.view.files import save_figure
        from knotwork.view.tradeoff_plot import plot_tradeoff

        written.append(save_figure(plot_tradeoff(curve), picture))
    if as_json:
        echo(json.dumps(curve.to_dict(), indent=1, allow_nan=False))
    else:
        print_tradeoff(curve)
        for path in written:
            echo(f"wrote {path}")
    return PASSED if all(point.ok for point in curve.points) else FAILED


def print_tradeoff(curve: Tradeoff) -> None:
    """Print the curve as a table."""
    from knotwork.cli import tables

    robot = curve.points[0].squared_effort is not None
    columns = ["duration\n[s]", "of the\nleast"]
    if robot:
        columns += ["∫torque²", "peak\ntorque", "of its\nlimit", "joint"]
    columns += ["peak\njerk", "of its\nlimit", "joint", ""]
    table = tables.plain_table(curve.scenario, columns, 0)
    jerk_units = set()
    letters: dict[str, str] = {}

    def letter(joint: str) -> str:
        return letters.setdefault(joint, chr(ord("A") + len(letters)))

    for point in curve.points:
        cells = [f"{point.duration:.4g}", f"{point.factor:.3g}"]
        if robot:
            cells += [_short(point.squared_effort), _short(point.peak_effort)]
            cells += [_percent(point.effort_use), letter(point.effort_joint)]
        jerk, unit = curve.units.shown(point.peak_jerk, point.jerk_unit)
        jerk_units.add(unit)
        cells += [_short(jerk), _percent(point.jerk_use), letter(point.jerk_joint)]
        marks = "ok" if point.ok else "[bold red]FAIL[/]"
        marks += " +" if point.stopped else ""
        table.add_row(*cells, f"{marks} *" if point.failure and point.ok else marks)
    tables.print_table(table)
    for point in curve.points:
        if point.failure:
            said = point.failure.split(" (", maxsplit=1)[0]
            tables.print_wrapped(f"{point.duration:.4g} s: {_why(point)}{said}", "", "  ")
    if curve.left_out:
        factors = ", ".join(f"{factor:g}" for factor in curve.left_out)
        said = f"the budget ended before a motion was found at {factors} of the least time"
        tables.print_wrapped(said, "", "  ")
    if any(point.stopped for point in curve.points):
        echo("+ the best found when the budget ended")
    joints = ", ".join(f"{mark} {joint}" for joint, mark in letters.items())
    tables.print_wrapped(f"joints: {joints}", "", "  ")
    units = f"torque in N m or N, jerk in {' or '.join(sorted(jerk_units))}"
    tables.print_wrapped(f"{units}; peaks are those of the joint nearest its limit", "", "")


def _why(point: TradeoffPoint) -> str:
    if not point.ok:
        return ""
    least = {"effort and jerk": "torque and jerk", "jerk": "jerk alone"}[point.objective]
    return f"* of least {least}, because that of least torque fails: "


def _short(value: Any) -> str:
    return "-" if value is None else readable(value)


def _percent(use: float | None) -> str:
    return "-" if use is None else f"{100.0 * use:.0f} %"
