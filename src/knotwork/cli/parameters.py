"""Kinds of arguments that several commands take."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import click

PASSED, FAILED, WRONG_INPUT = 0, 1, 2

Command = TypeVar("Command", bound=Callable[..., Any])


class Knots(click.ParamType[Any]):
    """`paper`, `balanced`, `optimal`, `balanced:C` or knot times divided by commas."""

    name = "knots"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Read the argument; what it means is for the planner."""
        if value in ("paper", "balanced", "optimal"):
            return value
        text = str(value).removeprefix("balanced:")
        ruled = text != value
        try:
            numbers = [float(part) for part in text.split(",")]
        except ValueError:
            numbers = []
        if not numbers or (ruled and len(numbers) > 1):
            self.fail(
                f"{value!r} is not accepted; give paper, balanced, optimal, balanced:C with a "
                "constant C over 0 up to 0.5, or the knot times in s divided by commas",
                param,
                ctx,
            )
        if len(numbers) == 1 and not ruled:
            self.fail(
                f"{value!r} is a single time, and a motion has knots at its start and its end; "
                f"did you mean balanced:{text}?",
                param,
                ctx,
            )
        return numbers[0] if ruled else numbers


class GivenPath(click.Path):
    """Path of a file or folder; an empty one, as of an unset variable, is refused."""

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Read the argument."""
        if value == "":
            self.fail("an empty path is not accepted; for the current folder give .", param, ctx)
        return super().convert(value, param, ctx)


class NewPath(GivenPath):
    """Path of a file or folder to write."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)


class Seconds(click.ParamType[Any]):
    """A time: `10`, `10s`, `500ms` or `2min`."""

    name = "time"
    UNITS: ClassVar[dict[str, float]] = {"ms": 1e-3, "min": 60.0, "s": 1.0}

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Read the argument, in seconds."""
        if isinstance(value, float):
            return value
        text, scale = str(value).strip(), 1.0
        for unit, factor in self.UNITS.items():
            if text.endswith(unit):
                text, scale = text.removesuffix(unit), factor
                break
        try:
            seconds = scale * float(text)
        except ValueError:
            seconds = 0.0
        if not 0.0 < seconds < math.inf:
            self.fail(
                f"{value!r} is not accepted; give a positive time such as 10s, 500ms or 2min",
                param,
                ctx,
            )
        return seconds


class Listed(click.ParamType[Any]):
    """Names or numbers divided by commas."""

    def __init__(self, kind: type[str] | type[float]) -> None:
        self.kind, self.name = kind, {str: "names", float: "numbers"}[kind]

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Read the argument."""
        if isinstance(value, list):
            return value
        parts = [part.strip() for part in str(value).split(",")]
        try:
            listed = [self.kind(part) for part in parts if part]
        except ValueError:
            listed = []
        if len(listed) < len(parts):
            self.fail(f"{value!r} is not accepted; give {self.name} divided by commas", param, ctx)
        return listed


planner_option = click.option(
    "--planner",
    metavar="NAME[:RULE]",
    help="Planner, in place of the scenario's; `knotwork planners` lists them and their rules.",
)
knots_option = click.option(
    "--knots",
    type=Knots(),
    metavar="KNOTS",
    help="paper, balanced, optimal, balanced:C, or knot times in s divided by commas; in place of "
    "the scenario's.",
)
full_option = click.option(
    "--full", is_flag=True, help="Print all findings, as tables; by default the tightest alone."
)
json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print JSON, and nothing else, on standard output."
)


def _look_in(context: Any, parameter: Any, folders: tuple[str, ...]) -> None:
    """Put folders in front of those of ROS, where every mesh is looked for."""
    if folders:
        listed = [*folders, *filter(None, [os.environ.get("ROS_PACKAGE_PATH")])]
        os.environ["ROS_PACKAGE_PATH"] = os.pathsep.join(listed)


package_path_option = click.option(
    "--package-path",
    metavar="DIR",
    multiple=True,
    type=GivenPath(exists=True, file_okay=False, resolve_path=True),
    expose_value=False,
    callback=_look_in,
    help="Folder that the robot's meshes are looked for in, before those of ROS_PACKAGE_PATH; "
    "may be repeated.",
)


def scenario_option(use: str, *, required: bool = False) -> Callable[[Command], Command]:
    """Make the option for the scenario of a trajectory."""
    return click.option(
        "--scenario",
        "-s",
        "reference",
        metavar="SCENARIO",
        required=required,
        help=f"For a TRAJECTORY: the scenario it is for, {use}.",
    )


def motion_options(use: str) -> Callable[[Command], Command]:
    """Make the argument and options of a command that shows a motion: planned, or from a file."""

    def add(command: Command) -> Command:
        for option in (scenario_option(use), knots_option, planner_option):
            command = option(command)
        return click.argument("source", metavar="SCENARIO|TRAJECTORY")(command)

    return add


def html_option(*, required: bool = False) -> Callable[[Command], Command]:
    """Make the option for a page to write."""
    return click.option(
        "-o",
        "--html",
        "out",
        metavar="FILE",
        required=required,
        type=NewPath(),
        help="Page to write, one file that any browser opens without a network. An existing one is "
        "replaced, a folder that is missing is made.",
    )
