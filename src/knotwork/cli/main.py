"""The command line: it loads a command, and reports errors by messages and exit codes."""

from __future__ import annotations

import atexit
import contextlib
import gc
import importlib
import io
import os
import sys
from typing import NoReturn, cast

import click

from knotwork import __version__
from knotwork.cli.parameters import (
    INTERNAL_ERROR,
    INTERRUPTED,
    PASSED,
    UNREAD,
    WRONG_INPUT,
    exit_codes,
)
from knotwork.cli.terminal import echo, echo_json, error_to_dict, internal_error
from knotwork.errors import KnotworkError

# No schema here uses pydantic's plugins, and searching for them takes time at every start.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
# NumPy starts threads in each process; matrices here are too small for them.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

_COMMANDS = {
    "plan": ("plan", "Plan scenarios, check the result, print the verdict."),
    "replan": ("replan", "Plan another task from a time of a running motion."),
    "check": ("check", "Check a stored trajectory against a scenario."),
    "compare": ("compare", "Plan a scenario with every planner and compare."),
    "sweep": ("sweep", "Plan a scenario many times, with varied values."),
    "plot": ("plot", "Draw joints and tool over time."),
    "view": ("view", "Show the moving arm in a browser, or in a file."),
    "edit": ("edit", "Change a scenario by hand, in the page of its motion."),
    "report": ("check", "Write a page to print or to send."),
    "export": ("export", "Export a motion: ROS 2, PVT, CSV, MATLAB, ..."),
    "robots": ("listing", "List the robots, or show one."),
    "scenarios": ("listing", "List the shipped scenarios."),
    "planners": ("compare", "List the planners: guarantees, limitations, options."),
    "schema": ("listing", "Print the JSON Schema of scenario files."),
}
"""Module and summary by command."""
_COMPARISON = ("compare", "planners")
"""Commands about other planners, which the help lists last."""


class _Commands(click.Group):
    """Loads only the requested command; summaries need no loading."""

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _COMMANDS:
            return None
        module, summary = _COMMANDS[cmd_name]
        command = getattr(importlib.import_module(f"knotwork.cli.{module}"), cmd_name)
        command.short_help = summary
        return cast("click.Command", command)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        others = [name for name in sorted(_COMMANDS) if name not in _COMPARISON]
        for heading, names in (("Commands", others), ("Comparison of planners", _COMPARISON)):
            with formatter.section(heading):
                formatter.write_dl([(name, _COMMANDS[name][1]) for name in names])


def main() -> NoReturn:
    """Run the command line and end the process with its exit code."""
    # Imported objects stay alive: searching them for cycles, repeatedly and at exit, takes as
    # long as a short plan.
    gc.set_threshold(200_000)
    atexit.register(gc.freeze)
    _occupy_closed_streams()
    if sys.stdout is None:
        echo("error: can't write the output: standard output is closed", err=True)
        sys.exit(WRONG_INPUT)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal may lack ² or table lines
    try:
        code = cli.main(standalone_mode=False)
        sys.stdout.flush()
    except click.ClickException as error:
        with contextlib.suppress(OSError):  # standard error may be closed
            error.show()
        code = WRONG_INPUT
    except (click.Abort, KeyboardInterrupt):
        echo("interrupted", err=True)
        code = INTERRUPTED
    except KnotworkError as error:
        if "--json" in sys.argv:
            echo_json({"ok": False, "error": error_to_dict(error)})
        echo(f"error: {error}", err=True)
        code = WRONG_INPUT
    except BrokenPipeError:
        _drop_output()  # the reader has closed the pipe
        code = UNREAD
    except MemoryError:
        echo("error: out of memory; use a lower rate or fewer scenarios", err=True)
        code = WRONG_INPUT
    except ModuleNotFoundError as error:  # an environment with a part of the dependencies
        echo(
            f"error: the package {error.name!r} is missing; install it, or knotwork by pip",
            err=True,
        )
        code = WRONG_INPUT
    except OSError as error:
        if error.filename is not None:  # should have been reported with the file
            code = _internal_error(error)
        else:
            _drop_output()
            echo(f"error: can't write the output: {error.strerror or error}", err=True)
            code = WRONG_INPUT
    except Exception as error:
        code = _internal_error(error)
    sys.exit(code or PASSED)


def _occupy_closed_streams() -> None:
    """Open the null device under the numbers of closed streams.

    Otherwise the next opened file would get such a number, and C code would write its messages
    into that file.
    """
    for number, stream in ((1, sys.stdout), (2, sys.stderr)):
        if stream is None:
            descriptor = os.open(os.devnull, os.O_WRONLY)
            if descriptor != number:
                os.dup2(descriptor, number)
                os.close(descriptor)


def _drop_output() -> None:
    """Discard standard output; Python would report an error when flushing it at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _internal_error(error: Exception) -> int:
    if os.environ.get("KNOTWORK_TRACEBACK"):
        raise error
    echo(internal_error(error), err=True)
    return INTERNAL_ERROR


@click.group(
    cls=_Commands,
    commands={name: click.Command(name) for name in _COMMANDS},  # suggested for unknown ones
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=f"Start with `knotwork plan ur5_deburring`. {exit_codes()}",
)
@click.version_option(
    __version__, "-V", "--version", prog_name="knotwork", message="%(prog)s %(version)s"
)
def cli() -> None:
    """Plan a verified C² joint trajectory from tool poses and speeds."""
