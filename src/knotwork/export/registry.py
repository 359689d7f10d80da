"""The formats in words, by name; what writes them is loaded elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from knotwork.errors import InputError, UnknownNameError


@dataclass(frozen=True)
class Format:
    """One format in words.

    Attributes:
        name: Its name.
        summary: What it is.
        suffix: What its files end in.
        binary: Its files are no text.
        options: Names of the keyword arguments that its exporter takes.
        module: Module of `knotwork.export` that writes it.
        function: What gives it in Python: text, bytes or an object.
        file_function: What gives the content of a file; empty if it has no file.
    """

    name: str
    summary: str
    suffix: str
    binary: bool
    options: tuple[str, ...]
    module: str
    function: str
    file_function: str

    def takes_points(self, options: Mapping[str, Any]) -> bool:
        """Whether it is made of points of the motion, with these options."""
        sampled = "knots_only" in self.options and not options.get("knots_only")
        return "fit" in self.options and not sampled

    @property
    def tabular(self) -> bool:
        """Whether it is a table of samples or points."""
        return "knots_only" in self.options


_TABLE = ("rate", "knots_only", "accelerations", "fit", "robot")

_ALL = (
    Format(
        "ros2",
        "YAML of a trajectory_msgs/JointTrajectory or, with --goal, a FollowJointTrajectory goal",
        ".yaml",
        False,
        ("goal", "accelerations", "fit"),
        "ros2",
        "to_ros2",
        "to_ros2",
    ),
    Format(
        "pvt",
        "position-velocity-time table for motion drives, as CSV",
        ".csv",
        False,
        ("degrees", "scale", "offset", "incremental", "fit"),
        "pvt",
        "to_pvt",
        "to_pvt",
    ),
    Format("csv", "samples or knots as CSV", ".csv", False, _TABLE, "samples", "to_csv", "to_csv"),
    Format(
        "json", "samples or knots as JSON", ".json", False, _TABLE, "samples", "to_json", "to_json"
    ),
    Format(
        "npz", "samples or knots for NumPy", ".npz", True, _TABLE, "samples", "to_npz", "to_npz"
    ),
    Format(
        "parquet",
        "samples or knots as Parquet (needs pyarrow)",
        ".parquet",
        True,
        _TABLE,
        "samples",
        "to_parquet",
        "to_parquet",
    ),
    Format("mat", "polynomials for MATLAB's ppval", ".mat", True, (), "mat", "to_mat", "to_mat"),
    Format(
        "scipy",
        "PPoly of SciPy; as a file, its arrays c and x in an npz",
        ".npz",
        True,
        (),
        "scipy_ppoly",
        "to_scipy",
        "to_scipy_npz",
    ),
    Format(
        "drake",
        "PiecewisePolynomial of Drake; in Python only",
        "",
        True,
        (),
        "drake",
        "to_drake",
        "",
    ),
)

FORMATS: Mapping[str, Format] = MappingProxyType({form.name: form for form in _ALL})
"""All formats in words, by name."""


def get_format(name: str) -> Format:
    """Return the format of a name.

    Raises:
        UnknownNameError: There is none.
    """
    if not isinstance(name, str) or name not in FORMATS:
        raise UnknownNameError("format", name, FORMATS)
    return FORMATS[name]


def checked_options(form: Format, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options if the format takes all of them.

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
