"""`knotwork plan`: plan scenarios, check the result, print the verdict."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from knotwork import planning
from knotwork.cli.parameters import (
    FAILED,
    PASSED,
    WRONG_INPUT,
    budget_option,
    exit_codes,
    folder_option,
    freeze_option,
    full_option,
    json_option,
    package_path_option,
    planner_option,
    refuse,
)
from knotwork.cli.progress_display import show_planning
from knotwork.cli.short_report import describe_left_out, print_next, print_short
from knotwork.cli.terminal import echo, echo_json, echo_line, error_to_dict
from knotwork.errors import KnotworkError
from knotwork.files.storage import trajectory_to_dict
from knotwork.planning import Plan


@click.command(epilog=exit_codes())
@click.argument("scenarios", metavar="SCENARIO...", nargs=-1, required=True)
@folder_option("Write trajectory.json, samples.csv and report.json there, for one scenario.")
@planner_option
@click.option(
    "--rate",
    metavar="HZ",
    type=click.FloatRange(min=0, min_open=True),
    help="Samples per second in samples.csv, in place of the scenario's.",
)
@package_path_option
@full_option
@freeze_option
@budget_option
@json_option
def plan(
    scenarios: tuple[str, ...],
    out: Path | None,
    planner: str | None,
    rate: float | None,
    full: bool,
    freeze: Path | None,
    budget: float | None,
    as_json: bool,
) -> int:
    """Plan each SCENARIO, check the result, and print the verdict.

    SCENARIO is the name of a shipped scenario (listed by `knotwork scenarios`) or the path of a
    YAML file: `knotwork schema` prints its schema, and the shipped ones are examples.
    """
    if len(scenarios) > 1:
        refuse({"--freeze": freeze, "--out": out}, "there are several scenarios")
    results: list[tuple[str, Plan | KnotworkError, list[Path]]] = []
    for i, reference in enumerate(scenarios):
        position = f" ({i + 1} of {len(scenarios)})" if len(scenarios) > 1 else ""
        try:
            with show_planning(f"{reference}{position}", as_json) as progress:
                planned = planning.plan(
                    reference, planner=planner, budget=budget, progress=progress
                )
            written: list[Path] = []
            if freeze is not None:
                written.append(planned.freeze(freeze))
            if out is not None:
                written += planned.save(out, rate=rate)
            results.append((reference, planned, written))
        except KnotworkError as error:
            results.append((reference, error, []))
    code = max(_exit_code(result) for _, result, _ in results)
    if as_json:
        rows = [plan_to_dict(*row) for row in results]
        echo_json({"ok": code == PASSED, "plans": rows})
        return code
    for _, result, written in results:
        print_plan(result, written, full)
    (_, first, _), *others = results
    if not others and not full and isinstance(first, Plan):
        words = [*scenarios, *(["--planner", planner] if planner else [])]
        words += ["--budget", f"{budget:g}s"] if budget else []
        print_next(words, with_robot=first.report.robot is not None)
    if others:
        echo("\nScenarios")
        for name, result, _ in results:
            word = ("passed", "FAILED", "wrong input")[_exit_code(result)]
            echo_line(f"{name}: {word}", word, fg="green" if word == "passed" else "red")
    return code


def print_plan(result: Plan | KnotworkError, written: list[Path], full: bool) -> None:
    """Print the verdict on a plan, and the written files."""
    if isinstance(result, KnotworkError):
        echo(f"error: {result}", err=True)
        return
    if full:
        from knotwork.cli import report_tables

        report_tables.print_plan(result)
    else:
        print_short(result.report)
        if result.unsupported_options:
            echo(f"planned {describe_left_out(result)}")
    for path in written:
        echo(f"wrote {path}")


def _exit_code(result: Plan | KnotworkError) -> int:
    if isinstance(result, KnotworkError):
        return WRONG_INPUT
    return PASSED if result.report.ok else FAILED


def plan_to_dict(
    reference: str, result: Plan | KnotworkError, written: list[Path]
) -> dict[str, Any]:
    """Plain data on a plan, or on its error, and on the written files, for `--json`."""
    if isinstance(result, KnotworkError):
        return {"scenario": reference, "ok": False, "error": error_to_dict(result)}
    return {
        "scenario": result.scenario.name,
        "ok": result.report.ok,
        "report": result.report_to_dict(),
        "trajectory": trajectory_to_dict(result.trajectory),
        "files": [str(path) for path in written],
    }
