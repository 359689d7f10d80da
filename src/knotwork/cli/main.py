"""Commands and exit codes: 0 all checks pass, 1 a check fails, 2 the input is wrong."""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from knotwork import __version__
from knotwork.cli.compare import compare, planners
from knotwork.cli.export import export
from knotwork.cli.listing import robots, scenarios, schema
from knotwork.cli.logs import (
    RECORDING,
    LogOptions,
    compared_log,
    log_options,
    looks_recorded,
    recording_hint,
)
from knotwork.cli.parameters import (
    FAILED,
    PASSED,
    WRONG_INPUT,
    GivenPath,
    NewPath,
    Seconds,
    full_option,
    json_option,
    knots_option,
    package_path_option,
    planner_option,
    scenario_option,
)
from knotwork.cli.plot import plot
from knotwork.cli.progress import shown_progress
from knotwork.cli.report import report as report_command
from knotwork.cli.sources import read_checked
from knotwork.cli.sweep import sweep
from knotwork.cli.terminal import echo, internal_error
from knotwork.cli.tradeoff import tradeoff
from knotwork.cli.view import view
from knotwork.errors import InputError, KnotworkError

if TYPE_CHECKING:
    from knotwork.pipeline import Plan

# No schema here is for pydantic's plugins, and looking for some takes time at every start.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")

INTERNAL, INTERRUPTED, UNREAD = 3, 130, 141

_EXIT_CODES = """
Exit codes: 0 every check passes, 1 a check fails, 2 the input is wrong.
"""


def main() -> NoReturn:
    """Run the command line and end the process with its exit code."""
    if not _has_output():
        echo("error: can't write the output: standard output is closed", err=True)
        sys.exit(WRONG_INPUT)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal may not know ² or a table's lines
    try:
        code = cli.main(standalone_mode=False)
        sys.stdout.flush()
    except click.ClickException as error:
        with contextlib.suppress(OSError):  # nothing can be written to standard error
            error.show()
        code = WRONG_INPUT
    except (click.Abort, KeyboardInterrupt):
        echo("interrupted", err=True)
        code = INTERRUPTED
    except KnotworkError as error:
        if "--json" in sys.argv:
            fault = {"type": type(error).__name__, "message": str(error)}
            echo(json.dumps({"ok": False, "error": fault}, indent=1))
        echo(f"error: {error}", err=True)
        code = WRONG_INPUT
    except BrokenPipeError:
        _drop_output()  # whoever read it has stopped reading
        code = UNREAD
    except MemoryError:
        echo("error: out of memory; use a lower rate or fewer scenarios", err=True)
        code = WRONG_INPUT
    except OSError as error:
        if error.filename is not None:  # of a file, whose reader or writer should have said it
            code = _internal_error(error)
        else:
            _drop_output()
            echo(f"error: can't write the output: {error.strerror or error}", err=True)
            code = WRONG_INPUT
    except Exception as error:
        code = _internal_error(error)
    sys.exit(code or PASSED)


def _has_output() -> bool:
    """Whether there is a standard output.

    The number of a closed stream would go to the next file that is opened, into which C code would
    then write what it has to say: it is taken here.
    """
    for number, stream in ((1, sys.stdout), (2, sys.stderr)):
        if stream is None:
            taken = os.open(os.devnull, os.O_WRONLY)
            if taken != number:
                os.dup2(taken, number)
                os.close(taken)
    return sys.stdout is not None


def _drop_output() -> None:
    """Give up standard output; Python would complain when it flushes it in the end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _internal_error(error: Exception) -> int:
    if os.environ.get("KNOTWORK_TRACEBACK"):
        raise error
    echo(internal_error(error), err=True)
    return INTERNAL


@click.group(
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Start with `knotwork plan ur5_deburring`. Exit codes: 0 every check passes, 1 a check "
    "fails, 2 the input is wrong, 3 Knotwork itself is at fault.",
)
@click.version_option(
    __version__, "-V", "--version", prog_name="knotwork", message="%(prog)s %(version)s"
)
def cli() -> None:
    """Tool poses and speeds in, a verified C² joint trajectory out."""


@click.command(epilog=_EXIT_CODES)
@click.argument("scenarios", metavar="SCENARIO...", nargs=-1, required=True)
@click.option(
    "--out",
    "-o",
    metavar="DIR",
    type=NewPath(),
    help="Write trajectory.json, samples.csv and report.json there; with several scenarios, in a "
    "folder for each below it.",
)
@planner_option
@knots_option
@click.option(
    "--rate",
    metavar="HZ",
    type=click.FloatRange(min=0, min_open=True),
    help="Samples per second in samples.csv, in place of the scenario's.",
)
@package_path_option
@full_option
@click.option(
    "--freeze",
    metavar="FILE",
    type=NewPath(),
    help="Write the scenario there with the chosen times and speeds as numbers, comments kept; "
    "planning that file gives the same motion. For one scenario whose times are free.",
)
@click.option(
    "--budget",
    metavar="TIME",
    type=Seconds(),
    help="Where times are free: take the best motion found after so long, for example 10s.",
)
@json_option
def plan(
    scenarios: tuple[str, ...],
    out: Path | None,
    planner: str | None,
    knots: Any,
    rate: float | None,
    full: bool,
    freeze: Path | None,
    budget: float | None,
    as_json: bool,
) -> int:
    """Plan each SCENARIO, check the result, and print the verdict.

    SCENARIO is the name of a shipped scenario (`knotwork scenarios` lists them) or the path of a
    YAML file: `knotwork schema` says what one may hold, and the shipped ones are examples.
    """
    from knotwork import pipeline

    if freeze is not None and len(scenarios) > 1:
        raise InputError(f"--freeze writes one file, and there are {len(scenarios)} scenarios")
    results: list[tuple[str, Plan | KnotworkError, list[Path]]] = []
    for reference in _with_progress(scenarios, as_json):
        try:
            with shown_progress(reference, as_json) as progress:
                planned = pipeline.plan(
                    reference, planner=planner, knots=knots, budget=budget, progress=progress
                )
            written: list[Path] = []
            if freeze is not None:
                written.append(planned.freeze(freeze))
            if out is not None:
                folder = out / _folder_name(planned, results) if len(scenarios) > 1 else out
                written += planned.save(folder, rate=rate)
            results.append((reference, planned, written))
        except KnotworkError as error:
            results.append((reference, error, []))
    code = max(_verdict(result) for _, result, _ in results)
    if as_json:
        rows = [_plan_to_dict(*row) for row in results]
        echo(json.dumps({"ok": code == PASSED, "plans": rows}, indent=1, allow_nan=False))
        return code
    from knotwork.cli import report_tables, tables

    for _, result, written in results:
        if isinstance(result, KnotworkError):
            echo(f"error: {result}", err=True)
        else:
            report_tables.print_plan(result, full=full)
            for path in written:
                echo(f"wrote {path}")
            if not full and len(results) == 1:
                tables.print_next(scenarios[0])
    if len(results) > 1:
        tables.print_summary([(name, _word(result)) for name, result, _ in results])
    return code


def _with_progress(scenarios: tuple[str, ...], as_json: bool) -> Any:
    """Show progress on standard error while several scenarios are planned."""
    if len(scenarios) < 2 or as_json or sys.stderr is None or not sys.stderr.isatty():
        return scenarios
    from rich.console import Console
    from rich.progress import track

    return track(scenarios, "planning", console=Console(stderr=True), transient=True)


def _folder_name(result: Plan, earlier: list[tuple[str, Any, list[Path]]]) -> str:
    """Name of the scenario, which must be one of a kind among several."""
    name = Path(result.scenario.name).name
    if name in ("", ".."):
        raise InputError(
            f"no folder can be named after scenario {result.scenario.name!r}; plan it by itself or "
            "rename it"
        )
    for reference, other, _ in earlier:
        if not isinstance(other, KnotworkError) and Path(other.scenario.name).name == name:
            raise InputError(
                f"two scenarios are named {name!r}, the other is {reference}; their files would "
                "overwrite each other: plan them one by one or rename one"
            )
    return name


def _verdict(result: Plan | KnotworkError) -> int:
    if isinstance(result, KnotworkError):
        return WRONG_INPUT
    return PASSED if result.report.ok else FAILED


def _word(result: Plan | KnotworkError) -> str:
    return ("passed", "FAILED", "wrong input")[_verdict(result)]


def _plan_to_dict(
    reference: str, result: Plan | KnotworkError, written: list[Path]
) -> dict[str, Any]:
    if isinstance(result, KnotworkError):
        return {
            "scenario": reference,
            "ok": False,
            "error": {"type": type(result).__name__, "message": str(result)},
        }
    from knotwork.storage import trajectory_to_dict

    return {
        "scenario": result.scenario.name,
        "ok": result.report.ok,
        "report": result.report_to_dict(),
        "trajectory": trajectory_to_dict(result.trajectory),
        "files": [str(path) for path in written],
    }


@click.command(epilog=_EXIT_CODES)
@click.argument("trajectory", type=GivenPath(path_type=Path))
@scenario_option("which it is checked against")
@log_options
@package_path_option
@full_option
@json_option
def check(
    trajectory: Path,
    reference: str | None,
    full: bool,
    as_json: bool,
    log: LogOptions | None,
) -> int:
    """Check a stored TRAJECTORY against a scenario and print the verdict.

    TRAJECTORY is a trajectory.json, a folder with one in it, or another tool's: CSV with headings,
    JSON with joint_names, time and positions, or YAML of a ROS 2 JointTrajectory. Joints are
    matched by name. Between the points of another tool the motion is what a ROS 2 controller
    makes of them: quintics if they have velocities and accelerations, cubics if they have
    velocities, and straight lines otherwise.

    With --log or --against it is the log of a robot: headings of PlotJuggler, ROS bags and RTDE are
    understood, the noise is estimated, and what fails by less than the noise can make is undecided.
    Its clock is set by the plan given with --against, or by planning the scenario. With --against
    the scenario may be left out.
    """
    scenario = None
    pieces = 0
    if reference is not None:
        with recording_hint(trajectory, log):
            checked = read_checked(trajectory, reference, log)
        report, scenario = checked.report, checked.scenario
        pieces = len(checked.trajectory.polynomial.x) - 1
    elif log is not None:
        report = compared_log(trajectory, log)
    else:
        raise click.MissingParameter(param_hint="'--scenario' / '-s'", param_type="option")
    if as_json:
        echo(json.dumps(report.to_dict(), indent=1, allow_nan=False))
    else:
        from knotwork.cli import report_tables, tables

        if full:
            report_tables.print_report(report, scenario)
        else:
            report_tables.print_brief(report)
            echo(f"the motion: {report.planner}")
            given = f"{trajectory}" + (f" -s {reference}" if reference is not None else "")
            tables.print_next(given)
    if log is None and not report.ok and looks_recorded(trajectory, pieces):
        echo(f"hint: {RECORDING}", err=True)
    return PASSED if report.ok else FAILED


for _command, _summary in (
    (plan, "Plan scenarios, check the result, print the verdict."),
    (check, "Check a stored trajectory against a scenario."),
    (compare, "Plan a scenario with every planner, side by side."),
    (sweep, "Plan a scenario many times, with other values."),
    (tradeoff, "Show what the least time is traded for."),
    (plot, "Draw joints and tool over time."),
    (view, "Show the arm make the move in a browser, or in a file."),
    (report_command, "Write one page to print or to send."),
    (export, "Hand a motion over: ROS 2, PVT, CSV, MATLAB, ..."),
    (robots, "List the robots, or show one."),
    (scenarios, "List the shipped scenarios."),
    (planners, "List the planners: what each can and can not do."),
    (schema, "Print the JSON Schema of scenario files."),
):
    _command.short_help = _summary
    cli.add_command(_command)
