"""A robot for a terminal, and as plain data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.cli.tables import console, plain_table
from knotwork.cli.terminal import cell

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.scene.model import CollisionModel
    from knotwork.waypoints import FloatArray


def print_robot(robot: Robot) -> None:
    """Print a robot's joints, limits, frames and configurations."""
    out = console()
    out.print(f"[bold]{cell(robot.name)}[/]  {cell(robot.description.strip(), lines=True)}")
    out.print(f"model {cell(str(robot.urdf))}", soft_wrap=True)
    out.print(f"base frame {cell(robot.base_frame)}, tool frame {cell(str(robot.tool_frame))}")
    limits = {
        "lower": robot.lower_position_limit,
        "upper": robot.upper_position_limit,
        **robot.limits,
    }
    table = plain_table("Joint limits [SI]", ["joint", "unit", *limits], 2)
    for i, name in enumerate(robot.joint_names):
        cells = [
            f"{limit[i]:.4g}" if np.isfinite(limit[i]) else "none" for limit in limits.values()
        ]
        table.add_row(cell(name), robot.joint_units[i], *cells)
    out.print(table)
    for shown in _fitting(robot):
        table = plain_table("Configurations [SI]", ["joint", *shown])
        for i, name in enumerate(robot.joint_names):
            values = (f"{positions[i]:.4f}" for positions in shown.values())
            table.add_row(cell(name), *values)
        out.print(table)
    if robot.locked:
        locked = ", ".join(f"{name} = {value:g}" for name, value in robot.locked.items())
        out.print(f"locked joints: {cell(locked)}")
    console(wrap=True).print(f"frames: {cell(', '.join(robot.frame_names))}")


def _fitting(robot: Robot) -> Iterator[dict[str, FloatArray]]:
    """Configurations, as many at a time as fit the width of the terminal."""
    width = console(wrap=True).width
    taken = start = 2 + max(map(len, robot.joint_names))
    shown: dict[str, FloatArray] = {}
    for name, positions in robot.configurations.items():
        column = 2 + max(8, len(name))
        if shown and taken + column > width:
            yield shown
            shown, taken = {}, start
        shown[name] = positions
        taken += column
    if shown:
        yield shown


def print_collisions(robot: Robot, model: CollisionModel) -> None:
    """Print which pairs of links are checked for collisions, and why others are not."""
    out = console()
    out.print(f"[bold]{cell(robot.name)}[/]  {cell(robot.description.strip(), lines=True)}")
    data = collisions_to_dict(robot, model)
    shapes = plain_table("Collision shapes", ["link", "shapes"])
    for link, count in data["links"].items():
        shapes.add_row(cell(link), str(count))
    out.print(shapes)
    for sentence in filter(None, (*model.missing, model.said_of_bare)):
        out.print(f"[yellow]warning[/] {cell(sentence)}", soft_wrap=True)
    ignored = plain_table("Pairs that are not checked", ["link", "link", "why"], 3)
    for pair in data["ignored"]:
        ignored.add_row(cell(pair["first"]), cell(pair["second"]), cell(pair["reason"]))
    out.print(ignored)
    checked = plain_table("Pairs that are checked", ["link", "link"], 2)
    for first, second in data["checked"]:
        checked.add_row(cell(first), cell(second))
    out.print(checked)
    out.print("Links that no joint moves to one another are not listed.")


def collisions_to_dict(robot: Robot, model: CollisionModel) -> dict[str, Any]:
    """Give what is checked for collisions as plain data."""
    names = [body.name for body in model.bodies]
    return {
        "name": robot.name,
        "links": {body.name: len(body.solids) for body in model.bodies},
        "checked": [[names[pair.first], names[pair.second]] for pair in model.pairs],
        "ignored": [
            {"first": one.first, "second": one.second, "reason": one.reason}
            for one in model.ignored
        ],
        "missing": list(model.missing),
        "without_shapes": list(model.bare),
    }


def robot_to_dict(robot: Robot) -> dict[str, Any]:
    """Give a robot as plain data; `null` stands for no limit."""
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
        "frames": list(robot.frame_names),
        "joints": dict(zip(names, robot.joint_units, strict=True)),
        "limits": {
            "lower_position_limit": finite(robot.lower_position_limit),
            "upper_position_limit": finite(robot.upper_position_limit),
            **{f"{kind}_limit": finite(values) for kind, values in robot.limits.items()},
        },
        "locked": dict(robot.locked),
        "configurations": {
            name: dict(zip(names, map(float, values), strict=True))
            for name, values in robot.configurations.items()
        },
    }
