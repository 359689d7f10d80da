"""The command `knotwork view`."""

from __future__ import annotations

import contextlib
import io
import shlex
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import click

from knotwork.cli.live_view import WatchedFiles, serve_live
from knotwork.cli.logs import LogOptions, log_options
from knotwork.cli.parameters import (
    PlanOptions,
    exit_codes,
    html_option,
    motion_options,
    no_open_option,
    options_by_name,
    package_path_option,
    port_option,
    refuse,
)
from knotwork.cli.sources import checked_motions, print_failures, read_motions
from knotwork.cli.terminal import echo, offered
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.files.documents import resources
from knotwork.planning import plan
from knotwork.planning.sweeps.folder import is_study
from knotwork.planning.sweeps.named_files import named_files
from knotwork.robot import Robot, load_robot
from knotwork.verification.report import AnyMotion, CheckedMotion
from knotwork.view.live_server import LiveServer
from knotwork.view.meshcat_player import play_scene
from knotwork.view.page import Page, scene_page
from knotwork.view.page_server import PageServer
from knotwork.view.picture_files import checked_path
from knotwork.view.scene_data import scene_of, scene_of_trajectory
from knotwork.view.side_by_side import side_by_side
from knotwork.view.study_map import MapServer, map_page

_VIEW_EPILOG = """
In the page: space plays and pauses, the arrow keys step by frame, the mouse turns the scene,
c shows the collision shapes of the links.
FILE.html#t=2.5 opens at that time, FILE.html#paused at the start.

"""
_SHOWN = "the scene is shown or written, also where a check fails"


@click.command(epilog=_VIEW_EPILOG + exit_codes(_SHOWN, ""))
@html_option()
@click.option(
    "--beside",
    metavar="OTHER",
    help="Show another scenario's motion side by side, with one clock and their difference.",
)
@click.option(
    "--watch",
    is_flag=True,
    help="Plan again whenever the scenario, its robot or a file named in them is saved, and update "
    "the open page.",
)
@click.option("--meshcat", is_flag=True, help="Play in Meshcat instead, with a new server.")
@no_open_option
@port_option
@click.option("--robot", metavar="ROBOT", help="For a TRAJECTORY without a scenario: its robot.")
@package_path_option
@log_options
@motion_options("to show waypoints and failures")
def view(
    source: str,
    out: Path | None,
    beside: str | None,
    options: PlanOptions,
    no_open: bool,
    port: int | None,
    reference: str | None,
    robot: str | None,
    watch: bool,
    meshcat: bool,
    log: LogOptions | None,
) -> None:
    """Show the moving arm in a browser.

    SCENARIO is the name of a shipped scenario or the path of a file; it is planned first.
    TRAJECTORY is any input of `knotwork check`: a trajectory.json, its folder, or another tool's
    CSV, JSON or ROS 2 YAML. The folder of a study, written by `knotwork sweep`, is shown as a
    map: a click on a row shows its motion or why it failed. With --html the map is one file,
    without the motions.

    The page shows the tool's path, coloured by speed, the waypoints with their velocities, the
    rebuilt knots, and failures of the check in red. The page is served on this machine only,
    until Ctrl-C.
    """
    arm = load_robot(robot) if robot is not None else None
    if out is not None:
        checked_path("page", out)
        served = {"--port": port, "--no-open": no_open, "--watch": watch}
        refuse(served, "--html writes a file")
    read = partial(read_motions, source, reference, options, robot=arm, log=log, find_scenario=True)
    of_one_motion = {"--robot": robot, "--log or --against": log, "--watch": watch}
    if meshcat:
        of_own_page = {"--html": out, "--watch": watch, "--beside": beside, "--port": port}
        refuse(of_own_page, "--meshcat plays in Meshcat's own page")
        motion = read()[0]
        print_failures([motion])
        if isinstance(motion, JointTrajectory):
            raise InputError("Meshcat needs a task with its motion: give --scenario")
        play_in_meshcat(motion, no_open)
    elif is_study(source):
        of_planned = {"--scenario": reference, **options_by_name(asdict(options))}
        unfit = {"--beside": beside, **of_one_motion, **of_planned}
        refuse(unfit, f"{source} is the folder of a study, which is shown as a map")
        _map(source, out, port, no_open)
    elif beside is not None:
        refuse(of_one_motion, "--beside shows two motions")
        _show(_beside(source, beside, reference, options), out, port, no_open)
    elif watch:
        _watch(source, reference, port, no_open, read, arm)
    else:
        _show(scene_page(_scene(source, arm, read())), out, port, no_open)


def _map(source: str, out: Path | None, port: int | None, no_open: bool) -> None:
    """Serve or write the map of a study."""
    from knotwork.planning.sweeps import Study

    study = Study.open(source)

    def page_of(row: int) -> Page:
        return scene_page(scene_of(plan(study.scenario(row))))

    if out is None:
        _serve(MapServer(study, page_of, port or 0), study.name, no_open)
    else:
        command = f"knotwork view {shlex.quote(source)}"
        echo(f"wrote {map_page(study, command).save(out)}; {command} shows the motions")


def _beside(source: str, other: str, reference: str | None, options: PlanOptions) -> Page:
    """The page that shows two motions side by side."""
    shown = checked_motions(
        read_motions(name, reference, options, find_scenario=True)[0] for name in (source, other)
    )
    if len(shown) < 2:
        raise InputError("side by side, two motions need their tasks: give --scenario")
    names = [motion.scenario.name for motion in shown]
    return side_by_side(shown, names if names[0] != names[1] else [source, other])


def _show(page: Page, out: Path | None, port: int | None, no_open: bool) -> None:
    """Write or serve a page."""
    for warning in page.warnings:
        echo(f"warning: {warning}", err=True)
    if out is None:
        _serve(PageServer(page.html, port or 0), page.title, no_open)
    else:
        echo(f"wrote {page.save(out)}")


def _scene(
    source: str,
    robot: Robot | None,
    motions: list[AnyMotion],
    previous: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The scene of the first motion; failures of all are printed."""
    print_failures(motions)
    motion = motions[0]
    if not isinstance(motion, JointTrajectory):
        return scene_of(motion, previous)
    if robot is None:
        raise InputError(
            f"{source} does not name its robot; give its scenario "
            "with --scenario, or its robot with --robot"
        )
    return scene_of_trajectory(robot, motion, previous)


def _watch(
    source: str,
    reference: str | None,
    port: int | None,
    no_open: bool,
    read: Callable[[], list[AnyMotion]],
    robot: Robot | None,
) -> None:
    """Serve a page that is built again when its files change."""

    def build() -> tuple[dict[str, Any], list[Path], str]:
        motions = read()
        scene, motion = _scene(source, robot, motions, server.scene), motions[0]
        if isinstance(motion, JointTrajectory):
            return scene, [], "shown"
        verdict = "passed" if motion.report.ok else "FAILED"
        return scene, source_files(motion), f"{verdict}: {motion.report.summary}"

    files = [_file(name) for name in (source, reference) if name is not None]
    server = LiveServer(source, port or 0)
    with server, offered(server.address, f"showing {source} after each save", no_open):
        serve_live(server, WatchedFiles(files), build)


def _file(name: str) -> Path:
    """File of a source: the file of a shipped scenario, or the trajectory in a folder."""
    if name in resources.names("scenarios"):
        return resources.find("scenarios", name)
    path = Path(name)
    if not path.exists():
        raise InputError(f"there is no file {name!r} to follow; accepted: the path of a file")
    return path / "trajectory.json" if path.is_dir() else path


def source_files(motion: Any) -> list[Path]:
    """Files that a plan or a checked file depends on."""
    robot, source = motion.joints.robot, motion.scenario.source
    robot_files: list[Path | None] = []
    if robot is not None:
        robot_files = [robot.source, robot.srdf, *(file.path for file in robot.urdf_files)]
    named = named_files(motion.scenario.task.to_dict(), source.parent) if source else {}
    return [path for path in (source, *robot_files, *named.values()) if path is not None]


def _serve(server: PageServer, title: str, no_open: bool) -> None:
    with server, offered(server.address, f"showing {title}", no_open):
        server.serve_forever(poll_interval=0.1)


def play_in_meshcat(motion: CheckedMotion, no_open: bool) -> None:
    """Play a motion in a new Meshcat viewer until Ctrl-C.

    Raises:
        InputError: The motion can't be shown.
    """
    import meshcat

    scene = scene_of(motion)
    for warning in scene["warnings"]:
        echo(f"warning: {warning}", err=True)
    with contextlib.redirect_stdout(io.StringIO()):  # Meshcat prints its address
        viewer = meshcat.Visualizer()
    play_scene(scene, viewer)
    with offered(viewer.url(), f"playing {scene['title']}", no_open):
        while True:
            time.sleep(3600.0)
