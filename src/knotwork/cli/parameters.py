"""Parameter types and options that several commands share, and the exit codes."""

from __future__ import annotations

import functools
import inspect
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import click

from knotwork.errors import InputError

PASSED, FAILED, WRONG_INPUT, INTERNAL_ERROR = 0, 1, 2, 3
"""Exit codes; out of memory counts as wrong input."""
INTERRUPTED, UNREAD = 130, 141
"""Exit codes after Ctrl-C, and after the reader of the output has closed its pipe."""


def exit_codes(passed: str = "every check passes", failed: str = "a check fails") -> str:
    """Explain the exit codes of a command; without `failed` it has no such code."""
    meanings = {PASSED: passed, FAILED: failed, WRONG_INPUT: "the input is wrong"}
    meanings[INTERNAL_ERROR] = "an internal error"
    return f"Exit codes: {', '.join(f'{code} {text}' for code, text in meanings.items() if text)}."


Command = TypeVar("Command", bound=Callable[..., Any])


class NonEmptyPath(click.Path):
    """Path of a file or folder; an empty one, as from an unset variable, is refused."""

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Read the argument."""
        if value == "":
            self.fail("an empty path is not accepted; for the current folder give .", param, ctx)
        return super().convert(value, param, ctx)


class Seconds(click.ParamType[Any]):
    """A time: `10`, `10s`, `500ms`, `5m`, `5min` or `1h`.

    Args:
        zero: Whether the time may be zero.
    """

    name = "time"
    UNITS: ClassVar = {None: 1.0, "ms": 1e-3, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0}

    def __init__(self, *, zero: bool = False) -> None:
        self.zero = zero

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Read the argument, in seconds."""
        match = re.fullmatch(r"\s*(\S*?)\s*(ms|s|min|m|h)?\s*", str(value))
        try:
            seconds = self.UNITS[match[2]] * float(match[1]) if match else -1.0
        except ValueError:
            seconds = -1.0
        if not (0.0 < seconds < math.inf or (self.zero and seconds == 0.0)):
            kind = "a time from 0 on" if self.zero else "a positive time"
            self.fail(
                f"{value!r} is not accepted; give {kind}: a number of seconds, or one "
                "with the unit ms, s, m (or min) or h, such as 10, 500ms, 10s, 5m or 1h",
                param,
                ctx,
            )
        return seconds


class NameList(click.ParamType[Any]):
    """Names separated by commas."""

    name = "names"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Read the argument."""
        if isinstance(value, list):
            return value
        parts = [part.strip() for part in str(value).split(",")]
        if not all(parts):
            self.fail(f"{value!r} is not accepted; give names separated by commas", param, ctx)
        return parts


planner_option = click.option(
    "--planner",
    metavar="NAME[:RULE]",
    help="Planner in place of the scenario's. `knotwork planners` lists them and their rules.",
)
budget_option = click.option(
    "--budget",
    metavar="TIME",
    type=Seconds(),
    help="Computing time after which the best motion so far is taken, such as 10s.",
)
full_option = click.option(
    "--full",
    is_flag=True,
    help="Print all findings as tables. By default only the tightest are printed.",
)
json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print JSON, and nothing else, on standard output."
)
freeze_option = click.option(
    "--freeze",
    metavar="FILE",
    type=NonEmptyPath(path_type=Path),
    help="Write the scenario with the chosen times and speeds as numbers, and keep its comments; "
    "planning that file gives the same motion. A sweep writes that of its best row. For one "
    "scenario.",
)
port_option = click.option(
    "--port",
    metavar="PORT",
    type=click.IntRange(1, 65535),
    help="Port of the address. By default any free one is taken.",
)
no_open_option = click.option(
    "--no-open", is_flag=True, help="Print the address only, and open no browser."
)


def options_by_name(options: Mapping[str, Any]) -> dict[str, Any]:
    """Values of options by their names on the command line, from those by names in Python."""
    return {f"--{name.replace('_', '-')}": value for name, value in options.items()}


def given_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """The options that are given: those whose value is not `None`, `False` or empty."""
    return {
        name: value
        for name, value in options.items()
        if value is not None and value is not False and value not in ((), {})
    }


def refuse(options: Mapping[str, Any], reason: str, remedy: str = "leave out") -> None:
    """Refuse given options that do not apply; the remedy is followed by their names.

    Raises:
        InputError: An option is given.
    """
    if given := given_options(options):
        raise InputError(f"{reason}: {remedy} {', '.join(given)}")


def names_option(name: str, help: str) -> Callable[[Command], Command]:
    """Make an option for names separated by commas."""
    return click.option(name, type=NameList(), metavar="A,B,…", help=help)


def folder_option(help: str) -> Callable[[Command], Command]:
    """Make the option for a folder to write."""
    return click.option("--out", "-o", metavar="DIR", type=NonEmptyPath(path_type=Path), help=help)


def _extend_package_path(context: Any, parameter: Any, folders: tuple[str, ...]) -> None:
    """Put folders first in the environment variable `ROS_PACKAGE_PATH` of this process."""
    if folders:
        listed = [*folders, *filter(None, [os.environ.get("ROS_PACKAGE_PATH")])]
        os.environ["ROS_PACKAGE_PATH"] = os.pathsep.join(listed)


package_path_option = click.option(
    "--package-path",
    metavar="DIR",
    multiple=True,
    type=NonEmptyPath(exists=True, file_okay=False, resolve_path=True),
    expose_value=False,
    callback=_extend_package_path,
    help="Folder searched for the robot's meshes, before those of ROS_PACKAGE_PATH; "
    "may be repeated.",
)


def scenario_option(use: str) -> Callable[[Command], Command]:
    """Make the option for the scenario of a trajectory."""
    return click.option(
        "--scenario",
        "-s",
        "reference",
        metavar="SCENARIO",
        help=f"For a TRAJECTORY: its scenario, {use}.",
    )


@dataclass(frozen=True)
class PlanOptions:
    """Planning options in place of the scenario's own.

    Attributes:
        planner: Name of a planner, optionally with a rule.
        budget: Computing time after which the best motion so far is taken [s].
    """

    planner: str | None = None
    budget: float | None = None


def bundle_options(name: str, make: Callable[..., Any], options: Sequence[Command]) -> Command:
    """Make a decorator that adds options; the command gets the result of `make` as `name`."""

    def add(command: Command) -> Command:

        @functools.wraps(command)
        def wrapped(*arguments: Any, **options_given: Any) -> Any:
            inputs = {key: options_given.pop(key) for key in inspect.signature(make).parameters}
            return command(*arguments, **options_given, **{name: make(**inputs)})

        for option in options:
            wrapped = option(wrapped)
        return wrapped  # type: ignore[return-value]

    return add  # type: ignore[return-value]


def motion_options(use: str) -> Callable[[Command], Command]:
    """Make the argument and options of a command that shows a motion: planned, or from a file.

    The command gets the planning options as `options`.
    """
    source = click.argument("source", metavar="SCENARIO|TRAJECTORY")
    options = (scenario_option(use), budget_option, planner_option, source)
    return bundle_options("options", PlanOptions, options)


def html_option(*, required: bool = False) -> Callable[[Command], Command]:
    """Make the option for a page to write."""
    return click.option(
        "-o",
        "--html",
        "out",
        metavar="FILE",
        required=required,
        type=NonEmptyPath(path_type=Path),
        help="Page to write, one file that any browser opens offline. An existing one is "
        "replaced, a missing folder is created.",
    )
