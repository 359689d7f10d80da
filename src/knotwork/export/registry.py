"""The export formats by name, and what each takes; the modules that write them are loaded later."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from knotwork.errors import InputError, UnknownNameError
from knotwork.exportable import DriveOptions, MessageOptions, ScriptOptions, TableOptions


@dataclass(frozen=True)
class Format:
    """One format in words.

    Attributes:
        name: Its name.
        summary: What it is.
        suffix: What its files end in; empty if it has no file.
        module: Module of `knotwork.export` that writes it.
        takes: The keyword arguments that its exporter takes, as a `TypedDict`.
        binary: Its files are no text.
    """

    name: str
    summary: str
    suffix: str
    module: str
    takes: type | None = None
    binary: bool = False

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the keyword arguments that its exporter takes."""
        return tuple(self.takes.__annotations__) if self.takes is not None else ()

    @property
    def function(self) -> str:
        """Name of the Python function that returns the text, bytes or object."""
        return f"to_{self.name}"

    @property
    def file_function(self) -> str:
        """Name of the function that returns the content of a file; empty without one."""
        if self.name == "scipy":
            return "to_scipy_npz"
        return self.function if self.suffix else ""

    def takes_points(self, options: Mapping[str, Any]) -> bool:
        """Whether the format, with these options, holds points of the motion."""
        sampled = self.tabular and not options.get("knots_only")
        return "fit" in self.options and not sampled

    @property
    def tabular(self) -> bool:
        """Whether the format is a table of samples or points."""
        return self.takes is TableOptions


_ALL = (
    Format(
        "ros2",
        "YAML for ros2 topic pub, or with --goal for ros2 action send_goal",
        ".yaml",
        "ros2",
        MessageOptions,
    ),
    Format(
        "pvt",
        "position-velocity-time table for motion drives, as CSV",
        ".csv",
        "pvt",
        DriveOptions,
    ),
    Format(
        "urscript",
        "program for a controller of Universal Robots",
        ".script",
        "urscript",
        ScriptOptions,
    ),
    Format("csv", "samples or knots as CSV", ".csv", "samples", TableOptions),
    Format("json", "samples or knots as JSON", ".json", "samples", TableOptions),
    Format("npz", "samples or knots for NumPy", ".npz", "samples", TableOptions, binary=True),
    Format(
        "parquet",
        "samples or knots as Parquet (needs pyarrow)",
        ".parquet",
        "samples",
        TableOptions,
        binary=True,
    ),
    Format("mat", "polynomials for MATLAB's ppval", ".mat", "polynomials", binary=True),
    Format(
        "scipy",
        "c and x of a PPoly in an npz; trajectory.to_scipy() in Python",
        ".npz",
        "polynomials",
        binary=True,
    ),
    Format(
        "drake",
        "for Drake there is trajectory.to_drake() in Python",
        "",
        "polynomials",
        binary=True,
    ),
)

FORMATS: Mapping[str, Format] = MappingProxyType({form.name: form for form in _ALL})
"""All formats in words, by name."""


def get_format(name: str) -> Format:
    """Return the format of a name.

    >>> form = get_format("pvt")
    >>> form.suffix, form.function, form.options
    ('.csv', 'to_pvt', ('degrees', 'scale', 'offset', 'incremental', 'fit'))

    Raises:
        UnknownNameError: There is none.
    """
    if not isinstance(name, str) or name not in FORMATS:
        raise UnknownNameError("format", name, FORMATS)
    return FORMATS[name]


def checked_options(form: Format, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options if the format takes all of them.

    >>> checked_options(get_format("csv"), {"rate": 50})
    {'rate': 50}

    Raises:
        InputError: One would be ignored.
    """
    for name in options:
        if name not in form.options:
            takers = [other.name for other in _ALL if name in other.options]
            raise InputError(
                f"format {form.name!r} takes no option {name!r}"
                + (f"; formats that do: {', '.join(takers)}" if takers else "")
            )
    return dict(options)


def file_format(name: str) -> Format:
    """Return the format of a name if it has a file.

    >>> file_format("scipy").file_function
    'to_scipy_npz'

    Raises:
        UnknownNameError: There is none of this name.
        InputError: It is an object in memory.
    """
    form = get_format(name)
    if not form.file_function:
        raise InputError(
            f"format {form.name!r} is an object in memory and has no file of its own; make it in "
            f"Python with trajectory.{form.function}()"
        )
    return form
