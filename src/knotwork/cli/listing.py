"""Commands that list the shipped robots, scenarios and the schema of scenario files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click
import numpy as np

from knotwork.cli.parameters import json_option
from knotwork.cli.tables import console, plain_table, print_entry, print_table, print_wrapped
from knotwork.cli.terminal import cell, echo, echo_json
from knotwork.files.documents import resources
from knotwork.joint_quantities import MAGNITUDES, RATE_QUANTITIES
from knotwork.robot import Robot, load_robot, robot_names
from knotwork.robot.load import robots_of_missing_packages
from knotwork.scene.building import build_robot_collision_model
from knotwork.scene.collision_model import CollisionModel
from knotwork.task import Task
from knotwork.task.scenario import load_scenario
from knotwork.units import Units

SHOWN_UNITS = Units("mm", "deg")
"""Units of limits and configurations on a terminal."""


@click.command()
@click.argument("name", required=False)
@click.option(
    "--collisions",
    "pairs",
    is_flag=True,
    help="List pairs of links checked for collisions, and excluded ones with reasons.",
)
@json_option
def robots(name: str | None, pairs: bool, as_json: bool) -> None:
    """List the shipped robots, or show one: joints, limits, links and configurations.

    NAME is the name of a shipped robot or the path of a robot file or URDF.
    """
    if pairs:
        _collisions(name, as_json)
        return
    shown = list(map(load_robot, robot_names() if name is None else [name]))
    rows = [robot_to_dict(robot) for robot in shown]
    if as_json:
        echo_json(rows[0] if name else rows)
    elif name is not None:
        print_robot(shown[0])
    else:
        for robot in shown:
            about = f"{len(robot.joint_names)} joints, tool frame {robot.tool_frame or '-'}"
            print_entry(robot.name, about, {"": robot.description})
        for package, names in robots_of_missing_packages():
            echo(f"after pip install {package}: {', '.join(names)}")
        echo("knotwork robots NAME shows one robot")


def _collisions(name: str | None, as_json: bool) -> None:
    """List the pairs of links checked for collisions."""
    if name is None:
        raise click.UsageError("--collisions needs the name of a robot")
    robot = load_robot(name)
    model = build_robot_collision_model(robot)
    data = collisions_to_dict(robot, model)
    if as_json:
        echo_json(data)
    else:
        print_collisions(robot, [*model.missing_shapes_notes, model.bare_links_note], data)


@click.command()
@json_option
def scenarios(as_json: bool) -> None:
    """List the shipped scenarios.

    With --json the duration is null if times are to be chosen.
    """
    rows = [
        {
            "name": scenario.name,
            "description": scenario.task.description.strip(),
            "robot": scenario.task.robot if isinstance(scenario.task.robot, str) else None,
            "waypoints": len(scenario.waypoints),
            "duration": None if scenario.unknowns else float(np.ptp(scenario.times)),
            "file": str(scenario.source),
        }
        for scenario in map(load_scenario, resources.names("scenarios"))
    ]
    if as_json:
        echo_json(rows)
    else:
        for row in rows:
            duration = row["duration"]
            lasting = "times to be chosen" if duration is None else f"{duration:.4g} s"
            about = f"{row['robot'] or 'no robot'}, {row['waypoints']} waypoints, {lasting}"
            print_entry(str(row["name"]), about, {"": str(row["description"])})
        echo("knotwork plan NAME plans one, knotwork view NAME shows it")


@click.command()
def schema() -> None:
    """Print the JSON Schema of scenario files."""
    echo(json.dumps(Task.model_json_schema(), indent=2))


def print_robot(robot: Robot) -> None:
    """Print a robot's joints, limits, links and configurations."""
    out, wrapping = console(), console(wrap=True)
    wrapping.print(f"[bold]{cell(robot.name)}[/]  {cell(robot.description.strip(), lines=True)}")
    out.print(f"model …/{cell(str(Path(*robot.urdf.parts[-2:])))}")
    out.print(f"base frame {cell(robot.base_frame)}, tool frame {cell(str(robot.tool_frame))}")
    limits = {kind: getattr(robot.limits, kind) for kind in ("lower", "upper", *MAGNITUDES)}
    table = plain_table("Joint limits", ["joint", "unit", *limits], 2)
    for i, (name, unit) in enumerate(zip(robot.joint_names, robot.joint_units, strict=True)):
        cells = [
            _number(float(limit[i]), unit if kind in ("lower", "upper", *RATE_QUANTITIES) else "")
            for kind, limit in limits.items()
        ]
        table.add_row(cell(name), SHOWN_UNITS.shown(0.0, unit)[1], *cells)
    print_table(table)
    configurations = {
        name: ", ".join(map(_number, map(float, positions), robot.joint_units))
        for name, positions in robot.configurations.items()
    }
    print_entry("Configurations", "in the order and units of the joints", configurations)
    if robot.locked:
        locked = ", ".join(f"{name} = {value:g}" for name, value in robot.locked.items())
        wrapping.print(f"locked joints (rad or m): {cell(locked)}")
    wrapping.print(f"links: {cell(', '.join(robot.link_names))}")
    out.print("times in s, efforts in N m or N; --json: SI, and the whole path of the model")


def _number(value: float, unit: str) -> str:
    """Text of a value in the displayed units; "none" for a missing limit."""
    if not np.isfinite(value):
        return "none"
    return SHOWN_UNITS.number(value, unit)


def print_collisions(robot: Robot, notes: list[str], data: dict[str, Any]) -> None:
    """Print the checked and the excluded pairs of links, with reasons."""
    print_entry(robot.name, robot.description, {})
    for sentence in filter(None, notes):
        print_wrapped(sentence, "warning ", " " * 5, "yellow")
    print_entry("Collision shapes", "", {link: str(n) for link, n in data["links"].items()})
    excluded = {f"{pair['first']}, {pair['second']}": pair["reason"] for pair in data["ignored"]}
    print_entry("Excluded pairs", "", excluded)
    print_entry("Checked pairs", "", {})
    for pair in data["checked"]:
        echo(f"  {', '.join(pair)}")
    echo("Links that are fixed to each other are not listed.")


def collisions_to_dict(robot: Robot, model: CollisionModel) -> dict[str, Any]:
    """Return the pairs of links checked for collisions as plain data."""
    names = [body.name for body in model.bodies]
    return {
        "name": robot.name,
        "links": {body.name: len(body.solids) for body in model.bodies},
        "checked": [[names[pair.first], names[pair.second]] for pair in model.pairs],
        "ignored": [
            {"first": pair.first, "second": pair.second, "reason": pair.reason}
            for pair in model.excluded
        ],
        "missing": list(model.missing_shapes_notes),
        "without_shapes": list(model.bare),
    }


def robot_to_dict(robot: Robot) -> dict[str, Any]:
    """Return a robot as plain data, with `None` for a missing limit."""
    names = robot.joint_names

    def finite(values: Any) -> dict[str, float | None]:
        return {
            name: float(value) if np.isfinite(value) else None
            for name, value in zip(names, values, strict=True)
        }

    return {
        "name": robot.name,
        "description": robot.description,
        "model": str(robot.urdf),
        "base_frame": robot.base_frame,
        "tool_frame": robot.tool_frame,
        "frames": list(robot.link_names),
        "joints": dict(zip(names, robot.joint_units, strict=True)),
        "limits": {
            "lower_position_limit": finite(robot.limits.lower),
            "upper_position_limit": finite(robot.limits.upper),
            **{f"{name}_limit": finite(robot.limits[name]) for name in MAGNITUDES},
        },
        "locked": dict(robot.locked),
        "configurations": {
            name: dict(zip(names, map(float, values), strict=True))
            for name, values in robot.configurations.items()
        },
    }
