"""Commands that list what is shipped: robots, scenarios and the schema of scenario files."""

from __future__ import annotations

import json

import click

from knotwork.cli.parameters import PASSED, json_option
from knotwork.cli.terminal import echo


@click.command()
@click.argument("name", required=False)
@click.option(
    "--collisions",
    "pairs",
    is_flag=True,
    help="List the pairs of links checked for collisions, and those that are not, and why.",
)
@json_option
def robots(name: str | None, pairs: bool, as_json: bool) -> int:
    """List the shipped robots, or show one: joints, limits, frames and configurations.

    NAME is a shipped robot's name or the path of a robot file or URDF.
    """
    from knotwork.cli import robot_tables, tables
    from knotwork.robot import load_robot, robot_names

    if pairs:
        return _collisions(name, as_json)
    shown = [load_robot(name)] if name is not None else [load_robot(one) for one in robot_names()]
    rows = [robot_tables.robot_to_dict(robot) for robot in shown]
    if as_json:
        echo(json.dumps(rows[0] if name else rows, indent=1, allow_nan=False))
    elif name is not None:
        robot_tables.print_robot(shown[0])
    else:
        for robot in shown:
            about = f"{len(robot.joint_names)} joints, tool frame {robot.tool_frame or '-'}"
            tables.print_entry(robot.name, about, {"": robot.description})
        echo("knotwork robots NAME shows one of them")
    return PASSED


def _collisions(name: str | None, as_json: bool) -> int:
    """List what is checked for collisions of one robot."""
    from knotwork.cli import robot_tables
    from knotwork.robot import load_robot
    from knotwork.scene.building import robot_collision_model

    if name is None:
        raise click.UsageError("--collisions needs the name of a robot")
    robot = load_robot(name)
    model = robot_collision_model(robot)
    if as_json:
        echo(json.dumps(robot_tables.collisions_to_dict(robot, model), indent=1))
    else:
        robot_tables.print_collisions(robot, model)
    return PASSED


@click.command()
@json_option
def scenarios(as_json: bool) -> int:
    """List the shipped scenarios.

    With --json the duration is null where times are free: planning chooses it.
    """
    import numpy as np

    from knotwork import resources
    from knotwork.scenario import load_scenario

    rows = [
        {
            "name": scenario.name,
            "description": scenario.description.strip(),
            "robot": scenario.robot if isinstance(scenario.robot, str) else None,
            "waypoints": len(scenario.waypoints),
            "duration": None if scenario.free else float(np.ptp(scenario.times)),
            "file": str(scenario.source),
        }
        for scenario in map(load_scenario, resources.names("scenarios"))
    ]
    if as_json:
        echo(json.dumps(rows, indent=1))
    else:
        from knotwork.cli import tables

        for row in rows:
            duration = row["duration"]
            lasting = "times are free" if duration is None else f"{duration:.4g} s"
            about = f"{row['robot'] or 'no robot'}, {row['waypoints']} waypoints, {lasting}"
            tables.print_entry(str(row["name"]), about, {"": str(row["description"])})
        echo("knotwork plan NAME plans one of them, knotwork view NAME shows it")
    return PASSED


@click.command()
def schema() -> int:
    """Print the JSON Schema of scenario files."""
    from knotwork.task import Task

    echo(json.dumps(Task.model_json_schema(), indent=2))
    return PASSED
