"""The command `knotwork plot`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from knotwork import view
from knotwork.cli.logs import LogOptions, log_options
from knotwork.cli.parameters import (
    NonEmptyPath,
    PlanOptions,
    exit_codes,
    motion_options,
    names_option,
    package_path_option,
)
from knotwork.cli.sources import print_failures, read_motions
from knotwork.cli.terminal import echo
from knotwork.errors import InputError
from knotwork.joint_quantities import MOTION_QUANTITIES
from knotwork.planning import Plan
from knotwork.verification.report import AnyMotion
from knotwork.view.picture_files import checked_path
from knotwork.view.plotted_motions import choose_names

_PLOT_EPILOG = """
Figures of the paper:

\b
12  knotwork plot paper_case --degrees -o figure12.png \\
      --quantities position,velocity,acceleration
13  knotwork plot paper_case --compare cubic,quintic --degrees \\
      --quantities position -o figure13.png
14  knotwork plot paper_case --compare cubic,quintic --degrees \\
      --quantities velocity -o figure14.png
15  knotwork plot paper_case --compare cubic,quintic --degrees \\
      --quantities acceleration -o figure15.png

There the quintic has zero accelerations at the waypoints; for the bad ones of the paper's Figure
14c, use the scenario paper_case_presets.

"""
_WRITTEN = "the picture is written, also where a check fails"


@click.command(epilog=_PLOT_EPILOG + exit_codes(_WRITTEN, ""))
@click.option(
    "--out",
    "-o",
    metavar="FILE",
    type=NonEmptyPath(path_type=Path),
    help="Picture to write: .png, .svg or .pdf. By default a .png named after the motion, in "
    "the current folder. An existing picture is replaced.",
)
@names_option("--joints", "Joints to draw. By default all are drawn.")
@names_option(
    "--quantities", "Quantities of position, velocity, acceleration and jerk; all by default."
)
@names_option(
    "--compare", "Planners to draw as well; a rule may follow a colon: quintic:estimated."
)
@click.option(
    "--tool",
    is_flag=True,
    help="Draw the tool: its speed, and its deviation from its path with the tolerances.",
)
@click.option(
    "--size",
    type=click.Choice(["a4", "slide"]),
    help="Size of the picture. By default it follows from the panels.",
)
@click.option(
    "--degrees/--radians",
    default=None,
    help="Unit of angles; by default the unit of the scenario.",
)
@log_options
@package_path_option
@motion_options("to mark waypoints and limits")
def plot(
    source: str,
    out: Path | None,
    compare: list[str] | None,
    options: PlanOptions,
    tool: bool,
    reference: str | None,
    log: LogOptions | None,
    **look: Any,
) -> None:
    """Draw a motion over time: position, velocity, acceleration and jerk of each joint.

    SCENARIO is the name of a shipped scenario or the path of a file; it is planned first.
    TRAJECTORY is any input of `knotwork check`: a trajectory.json, its folder (./NAME if a shipped
    scenario has the same name), or with --scenario another tool's CSV, JSON or ROS 2 YAML. With
    --log it is the log of a robot; --against draws the plan as well.

    Waypoints and knots are marked, and exceeded limits highlighted.
    """
    if tool and any(look.pop(name) for name in ("joints", "quantities")):
        raise InputError("--tool draws the tool, not joints: leave out --joints and --quantities")
    if out is not None:
        checked_path("picture", out)
    choose_names("quantity", look.get("quantities"), MOTION_QUANTITIES)
    drawn = read_motions(source, reference, options, compare, log=log)
    print_failures(drawn)
    draw = view.plot_tool if tool else view.plot_joints
    figure = draw(drawn, **look)
    path = out if out is not None else _default_path(source, drawn[0], tool)
    echo(f"wrote {view.save_figure(figure, path)}")


def _default_path(source: str, drawn: AnyMotion, tool: bool) -> Path:
    """A file in the current folder, named after the motion."""
    if isinstance(drawn, Plan):
        name = drawn.scenario.name
    else:
        file = Path(source).resolve()
        name = file.parent.name if file.stem == "trajectory" else file.stem
    stem = Path(name).name
    if stem in ("", "..") or stem != name:
        raise InputError(f"{name!r} can't be a file name; give one with -o FILE")
    return Path(f"{stem}_tool.png" if tool else f"{stem}.png")
