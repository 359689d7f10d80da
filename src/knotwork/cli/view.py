"""The command `knotwork view`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from knotwork.cli.logs import LogOptions, log_options
from knotwork.cli.parameters import PASSED, Names, html_option, motion_options, package_path_option
from knotwork.cli.sources import checked, read_motions, refuse, tell_failures
from knotwork.cli.terminal import echo
from knotwork.errors import InputError

if TYPE_CHECKING:
    from knotwork.view.page import Page

_EPILOG = """
In the page: space plays and pauses, the arrow keys go frame by frame, the mouse turns the scene,
c shows the shapes of the links that collisions are checked with.
FILE.html#t=2.5 opens at that time, FILE.html#paused at the start.

Exit codes: 0 the scene is shown or written, also where a check fails, 2 the input is wrong.
"""


@click.command(epilog=_EPILOG)
@html_option()
@click.option("--compare", type=Names(), metavar="A,B,…", help="Planners to show over it.")
@click.option("--no-ghosts", is_flag=True, help="No translucent copies of the arm at waypoints.")
@click.option("--no-open", is_flag=True, help="Open no browser; only say the address.")
@click.option(
    "--port",
    metavar="PORT",
    type=click.IntRange(1, 65535),
    help="Port of the address; by default any that is free.",
)
@click.option("--robot", metavar="ROBOT", help="For a TRAJECTORY without a scenario: its robot.")
@package_path_option
@log_options
@motion_options("to show waypoints and what fails")
def view(
    source: str,
    out: Path | None,
    compare: list[str] | None,
    planner: str | None,
    knots: Any,
    no_ghosts: bool,
    no_open: bool,
    port: int | None,
    reference: str | None,
    robot: str | None,
    log: LogOptions | None,
) -> int:
    """Show the arm making its move, in a browser.

    SCENARIO is the name of a shipped scenario or the path of a file; it is planned first.
    TRAJECTORY is what `knotwork check` reads: a trajectory.json, or the path of a folder with one
    in it, or another tool's CSV, JSON or ROS 2 YAML.

    Shown are the tool's path, coloured by its speed, the waypoints with the speeds asked for, the
    rebuilt knots, and in red what fails in the check. The page is served to this machine alone
    until Ctrl-C.
    """
    if out is not None:
        from knotwork.view.files import checked_page_path

        checked_page_path(out)
        refuse({"--port": port, "--no-open": no_open or None}, "--html writes a file")
    page = _page(source, reference, planner, knots, compare, robot, not no_ghosts, log)
    for warning in page.warnings:
        echo(f"warning: {warning}", err=True)
    if out is not None:
        echo(f"wrote {page.save(out)}")
        return PASSED
    return _serve(page, port, no_open)


def _page(
    source: str,
    reference: str | None,
    planner: str | None,
    knots: Any,
    compare: list[str] | None,
    robot_name: str | None,
    ghosts: bool,
    log: LogOptions | None,
) -> Page:
    from knotwork.robot import load_robot
    from knotwork.trajectory import JointTrajectory
    from knotwork.view.show import view_plan, view_trajectory

    robot = load_robot(robot_name) if robot_name is not None else None
    instead = ", or its robot with --robot"
    shown = read_motions(
        source, reference, planner, knots, compare, robot=robot, instead=instead, log=log
    )
    tell_failures(shown)
    first, *others = shown
    if not isinstance(first, JointTrajectory):
        refuse({"--robot": robot_name}, "the scenario names the robot")
        compared = {one.trajectory.planner: one.trajectory for one in checked(others)}
        return view_plan(first, compared, ghosts=ghosts)
    if robot is None:
        raise InputError(
            f"{source} does not say which arm it moves; give the scenario it was planned for with "
            "--scenario, or its robot with --robot"
        )
    return view_trajectory(robot, first, ghosts=ghosts)


def _serve(page: Page, port: int | None, no_open: bool) -> int:
    from knotwork.view.server import PageServer, open_browser

    with PageServer(page.html, port or 0) as server:
        echo(f"showing {page.title} at {server.address} until Ctrl-C")
        if not no_open and not open_browser(server.address):
            echo("no browser could be opened here; open the address in one", err=True)
        try:
            server.serve_forever(poll_interval=0.1)
        except KeyboardInterrupt:
            echo("stopped")
    return PASSED
