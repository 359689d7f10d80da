"""The command `knotwork view`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from knotwork.cli.logs import LogOptions, log_options
from knotwork.cli.parameters import (
    PASSED,
    Listed,
    PlanOptions,
    html_option,
    motion_options,
    package_path_option,
)
from knotwork.cli.sources import checked, print_failures, read_motions, refuse
from knotwork.cli.terminal import echo, offer
from knotwork.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from knotwork.cli.sources import Motion
    from knotwork.robot import Robot
    from knotwork.view.page import Page

_EPILOG = """
In the page: space plays and pauses, the arrow keys go frame by frame, the mouse turns the scene,
c shows the shapes of the links that collisions are checked with.
FILE.html#t=2.5 opens at that time, FILE.html#paused at the start.

Exit codes: 0 the scene is shown or written, also where a check fails, 2 the input is wrong.
"""


@click.command(epilog=_EPILOG)
@html_option()
@click.option("--compare", type=Listed(), metavar="A,B,…", help="Planners to show with it.")
@click.option("--no-ghosts", is_flag=True, help="Hide translucent copies of the arm at waypoints.")
@click.option(
    "--watch",
    is_flag=True,
    help="Plan again each time the scenario, its robot or a file they name is saved, and update "
    "the open page.",
)
@click.option(
    "--meshcat",
    metavar="[URL]",
    is_flag=False,
    flag_value="own",
    help="Play in Meshcat instead: in the server at this ZMQ address, such as "
    "tcp://127.0.0.1:6000, or without one in a server that ends with this command.",
)
@click.option("--no-open", is_flag=True, help="Open no browser; only print the address.")
@click.option(
    "--port",
    metavar="PORT",
    type=click.IntRange(1, 65535),
    help="Port of the address; by default any that is free.",
)
@click.option("--robot", metavar="ROBOT", help="For a TRAJECTORY without a scenario: its robot.")
@package_path_option
@log_options
@motion_options("to show waypoints and failures")
def view(
    source: str,
    out: Path | None,
    compare: list[str] | None,
    options: PlanOptions,
    no_ghosts: bool,
    no_open: bool,
    port: int | None,
    reference: str | None,
    robot: str | None,
    watch: bool,
    meshcat: str | None,
    log: LogOptions | None,
) -> int:
    """Show the moving arm in a browser.

    SCENARIO is the name of a shipped scenario or the path of a file; it is planned first.
    TRAJECTORY is what `knotwork check` reads: a trajectory.json, its folder, or another tool's
    CSV, JSON or ROS 2 YAML.

    The page shows the tool's path, coloured by its speed, the waypoints with their velocities, the
    rebuilt knots, and failures of the check in red. The page is served to this machine alone
    until Ctrl-C.
    """
    from knotwork.robot import load_robot

    if out is not None:
        from knotwork.view.picture_files import checked_page_path

        checked_page_path(out)
        served = {"--port": port, "--no-open": no_open or None, "--watch": watch or None}
        refuse(served, "--html writes a file")

    def made(
        before: Mapping[str, Any] | None = None, warm: Motion | None = None
    ) -> tuple[dict[str, Any], Motion]:
        arm = load_robot(robot) if robot is not None else None
        instead = ", or its robot with --robot"
        shown = read_motions(
            source, reference, options, compare, robot=arm, instead=instead, log=log, warm=warm
        )
        return _scene(source, shown, arm, before)

    if meshcat is not None:
        given = {"--html": out, "--watch": watch or None, "--port": port, "--compare": compare}
        refuse(given, "--meshcat plays in Meshcat's own page")
        return _play(read_motions(source, reference, options, log=log), meshcat, no_open)
    if watch:
        return _watch(source, reference, made, port, no_open, not no_ghosts)
    from knotwork.view.page import scene_page

    page = scene_page(made()[0], ghosts=not no_ghosts)
    for warning in page.warnings:
        echo(f"warning: {warning}", err=True)
    if out is not None:
        echo(f"wrote {page.save(out)}")
        return PASSED
    return _serve(page, port, no_open)


def _scene(
    source: str,
    shown: list[Motion],
    robot: Robot | None,
    before: Mapping[str, Any] | None,
) -> tuple[dict[str, Any], Motion]:
    from knotwork.trajectory import JointTrajectory
    from knotwork.view.show import scene_of, scene_of_trajectory

    print_failures(shown)
    first, *others = shown
    if not isinstance(first, JointTrajectory):
        refuse({"--robot": robot}, "the scenario names the robot")
        compared = {one.trajectory.planner: one.trajectory for one in checked(others)}
        return scene_of(first, compared, before), first
    if robot is None:
        raise InputError(
            f"{source} does not name the arm that it moves; give the scenario it was planned for "
            "with --scenario, or its robot with --robot"
        )
    return scene_of_trajectory(robot, first, before), first


def _play(shown: list[Motion], address: str, no_open: bool) -> int:
    """Play the first motion in Meshcat."""
    from knotwork.cli.meshcat_viewer import play_in_meshcat

    print_failures(shown)
    if not checked(shown[:1]):
        raise InputError("Meshcat is shown a task with its motion: give --scenario")
    play_in_meshcat(shown[0], address, no_open)
    return PASSED


def _watch(
    source: str,
    reference: str | None,
    made: Callable[[Mapping[str, Any] | None, Motion | None], tuple[dict[str, Any], Motion]],
    port: int | None,
    no_open: bool,
    ghosts: bool,
) -> int:
    """Serve a page that follows its files."""
    from knotwork.cli.live_view import Files, follow
    from knotwork.view.page_server import LiveServer

    last: Motion | None = None

    def renewed() -> tuple[dict[str, Any], list[Path], str]:
        nonlocal last
        scene, last = made(server.scene, last)
        return scene, _files(last), _verdict(last)

    given = [_file(name) for name in (source, reference) if name is not None]
    with LiveServer(source, port or 0, ghosts=ghosts) as server:
        offer(server.address, f"showing {source} at {server.address} after each save", no_open)
        follow(server, Files(given), renewed)
    return PASSED


def _file(name: str) -> Path:
    """File that a source is in: of a shipped scenario its own, of a folder its trajectory."""
    from knotwork import resources

    if name in resources.names("scenarios"):
        return resources.find("scenarios", name)
    path = Path(name)
    if not path.exists():
        raise InputError(f"there is no file {name!r} to follow; accepted: the path of a file")
    return path / "trajectory.json" if path.is_dir() else path


def _files(motion: Motion) -> list[Path]:
    """Files that a motion depends on, as far as they are known."""
    from knotwork.trajectory import JointTrajectory

    if isinstance(motion, JointTrajectory):
        return []
    robot = motion.space.robot
    described = (robot.source, robot.urdf, robot.srdf) if robot is not None else ()
    known = [path for path in (motion.scenario.source, *described) if path is not None]
    source = motion.scenario.source
    if source is None:
        return known
    return [*known, *_named_in(motion.scenario.task.to_dict(), source.parent)]


def _named_in(value: Any, folder: Path) -> list[Path]:
    """Files that texts anywhere in a document name, such as meshes and points of curves."""
    if isinstance(value, Mapping):
        return [path for each in value.values() for path in _named_in(each, folder)]
    if isinstance(value, list):
        return [path for each in value for path in _named_in(each, folder)]
    if not isinstance(value, str) or not Path(value).suffix:
        return []
    try:
        return [folder / value] if (folder / value).is_file() else []
    except (OSError, ValueError):  # no name that a file can have
        return []


def _verdict(motion: Motion) -> str:
    """The verdict in a line."""
    from knotwork.trajectory import JointTrajectory
    from knotwork.verification.brief import summary

    if isinstance(motion, JointTrajectory):
        return "shown"
    return f"{'passed' if motion.report.ok else 'FAILED'}: {summary(motion.report)}"


def _serve(page: Page, port: int | None, no_open: bool) -> int:
    from knotwork.view.page_server import PageServer

    with PageServer(page.html, port or 0) as server:
        offer(server.address, f"showing {page.title} at {server.address}", no_open)
        try:
            server.serve_forever(poll_interval=0.1)
        except KeyboardInterrupt:
            echo("stopped")
    return PASSED
