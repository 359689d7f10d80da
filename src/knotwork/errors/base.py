"""The base classes, and errors of input: names, files, arrays, options, formats."""

from __future__ import annotations

import copyreg
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from knotwork.errors.old_names import OldAttribute

AnyInputError = TypeVar("AnyInputError", bound="InputError")


class KnotworkError(Exception):
    """Base class of all errors that Knotwork raises on purpose.

    A subclass declares its data as attributes of the class, given by keyword. In all of them,
    `waypoint` is the name of a waypoint, and `waypoint_index` its index, counted from 0, in the
    scenario, or in the arrays where there is none.
    """

    def __init__(self, message: str = "", **data: Any) -> None:
        for name, value in data.items():
            if not hasattr(type(self), name):
                raise TypeError(f"{type(self).__name__} has no attribute {name!r}")
            setattr(self, name, tuple(value) if isinstance(value, list) else value)
        super().__init__(message)

    def __reduce__(self) -> tuple[Any, ...]:
        # By default a copy would only get the message as an argument.
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]


class InputError(KnotworkError, ValueError):
    """Wrong input: a value, a name, a file or a task that can't be used.

    >>> try:
    ...     kw.load_robot("ur6")
    ... except InputError as error:
    ...     print(str(error).partition("?")[0])
    unknown robot 'ur6'; did you mean 'ur5'

    Attributes:
        where: Location of the fault, for example a field of a file; empty if unknown.
        others: Errors found together with this one; `str()` lists each on a line.
        hint: Possible cause or remedy, with which `str()` ends.
    """

    where: str = ""
    others: Sequence[InputError] = ()
    hint: str = ""

    def __str__(self) -> str:
        text = "\n".join(dict.fromkeys(error.located_message for error in (self, *self.others)))
        return f"{text}; {self.hint}" if self.hint else text

    @property
    def located_message(self) -> str:
        """Message of this error alone, with its location."""
        message = super().__str__()
        return f"{self.where}: {message}" if self.where else message

    def locate(self, where: str) -> None:
        """Put an enclosing location in front of the location of this error."""
        self.where = f"{where}: {self.where}" if self.where else where


def merge_errors(errors: Sequence[AnyInputError]) -> AnyInputError:
    """Make the other errors the `others` of the first, and return the first.

    >>> print(merge_errors([InputError("is 3", where="a"), InputError("is 4", where="b")]))
    a: is 3
    b: is 4
    """
    first, *first.others = errors
    return first


MAX_LISTED = 40
"""Maximum number of names that an error lists."""


def suggest_name(name: object, available: Iterable[object]) -> str:
    """Suggest the available name nearest to the given one, and list the available names.

    Returns:
        A clause such as `did you mean 'ur5'? Accepted: panda, ur5`.
    """
    import difflib

    names = [str(choice) for choice in available]
    by_folded = {choice.casefold(): choice for choice in names}
    near = difflib.get_close_matches(str(name).casefold(), by_folded, n=1, cutoff=0.6)
    listed, rest = names, ""
    if len(names) > MAX_LISTED:  # only the most similar ones are listed
        alike = difflib.get_close_matches(str(name).casefold(), by_folded, MAX_LISTED, cutoff=0.0)
        listed = [by_folded[name] for name in alike]
        rest = f" and {len(names) - MAX_LISTED} more"
    listing = f"accepted: {', '.join(listed)}{rest}" if names else "none is available"
    meant = f"did you mean {by_folded[near[0]]!r}? " if near else ""
    return f"{meant}{listing[:1].upper()}{listing[1:]}" if near else listing


def format_value(value: Any) -> str:
    """Format a value for an error as one line of YAML of at most 60 characters."""
    try:
        text = _format_flow(value, 3)
    except ValueError:  # Python writes at most several thousand digits
        return "an integer of thousands of digits"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _format_flow(value: Any, depth: int) -> str:
    if isinstance(value, dict | list | tuple):
        if depth == 0:
            return "..."
        # 21 values fill 60 characters, so further ones would not be shown
        if isinstance(value, dict):
            items = itertools.islice(value.items(), 21)
            inner = ", ".join(f"{key}: {_format_flow(item, depth - 1)}" for key, item in items)
            return f"{{{inner}}}"
        return f"[{', '.join(_format_flow(item, depth - 1) for item in value[:21])}]"
    plain = {None: "null", True: "true", False: "false"}
    return plain[value] if value is None or isinstance(value, bool) else repr(value)


class UnknownNameError(InputError):
    """An unknown name.

    >>> try:
    ...     kw.interpolation.get_planner("cubics")
    ... except UnknownNameError as error:
    ...     print(error.name, error.available[:2])
    cubics ('modified-hermite', 'cubic')

    Attributes:
        kind: Kind of the named object, for example `"robot"` or `"joint"`.
        name: The given name.
        available: The accepted names.
    """

    def __init__(self, kind: str, name: str, available: Iterable[str], *, where: str = "") -> None:
        self.kind, self.name, self.available = kind, name, tuple(available)
        message = f"unknown {kind} {name!r}; {suggest_name(name, self.available)}"
        super().__init__(message, where=where)


@dataclass(frozen=True)
class Problem:
    """One problem in a file.

    Attributes:
        line: Line in the file, counted from 1, or `None`.
        field: Path of the field, for example `waypoints[2].time`; empty for the whole file.
        message: The problem, with the value found.
        accepted: Accepted values; empty if the message states them.
    """

    line: int | None
    field: str
    message: str
    accepted: str = ""

    def __str__(self) -> str:
        where = f"line {self.line}: " if self.line is not None else ""
        field = f"{self.field}: " if self.field else ""
        accepted = f"; accepted: {self.accepted}" if self.accepted else ""
        return f"{where}{field}{self.message}{accepted}"


MAX_PRINTED_PROBLEMS = 50
"""Maximum number of problems that a message lists."""


class DocumentError(InputError):
    """A file that can't be read or has wrong content, with every problem found in it.

    >>> ends = [{"joints": {"lift": "up"}}, {"joints": {"lift": 1}, "after": 0}]
    >>> try:
    ...     kw.load_scenario({"waypoints": ends})
    ... except DocumentError as error:
    ...     print([problem.field for problem in error.problems])
    ['waypoints[0].joints.lift', 'waypoints[1].after']

    Attributes:
        file: The file, or `None` for a mapping given in Python.
        problems: The problems, in the order of the file; the message lists the first 50.
    """

    def __init__(
        self, file: Path | str | None, problems: Sequence[Problem], *, complete: bool = True
    ) -> None:
        """List the problems. Without `complete` there may be further ones."""
        self.file, self.problems = file, tuple(problems)
        prefix = f"{file}: " if file is not None else ""
        lines = [f"{prefix}{problem}" for problem in self.problems[:MAX_PRINTED_PROBLEMS]]
        if len(self.problems) > MAX_PRINTED_PROBLEMS:
            more = len(self.problems) - MAX_PRINTED_PROBLEMS
            bound, plural = "" if complete else "at least ", "" if more == 1 else "s"
            lines.append(f"{prefix}and {bound}{more} more problem{plural}")
        super().__init__("\n".join(lines))


class RobotError(InputError):
    """A robot description that planning does not support.

    Attributes:
        robot: Name of the robot.
        joint: Name of the joint at fault, or `None`.
        link: Name of the link at fault, or `None`.
    """

    joint: str | None = None
    link: str | None = None

    def __init__(self, robot: str, message: str, **data: Any) -> None:
        self.robot = robot
        super().__init__(f"robot {robot!r}: {message}", **data)


class ArrayError(InputError):
    """Values that are not numbers, not finite, out of range, or not of the required shape.

    Attributes:
        value: The value found, or `None`.
        index: Index of the value that is not finite, or `None`.
    """

    value: Any = None
    index: tuple[int, ...] | None = None


class WaypointDataError(ArrayError):
    """Waypoint arrays that are not finite, not of matching shape, or not in time order.

    Attributes:
        waypoint_index: Index of the waypoint at fault, or `None`.
    """

    waypoint_index: int | None = None


class OptionError(InputError):
    """An option with a value that a planner does not accept.

    Attributes:
        option: Name of the option, a field of `PlannerOptions`.
        planner: Name of the planner, or `None` if no planner accepts the value.
    """

    planner: str | None = None

    def __init__(self, option: str, message: str) -> None:
        self.option = option
        super().__init__(f"option {option} {message}")


class KnotError(InputError):
    """Knots that don't increase, are too few or too many, or leave a waypoint outside its span.

    >>> task = kw.JointWaypoints(["lift"], [0, 1, 2], [[0], [1], [0]], [[0], [0.5], [0]])
    >>> try:
    ...     plan = kw.interpolation.get_planner("modified-hermite")
    ...     plan(task, kw.interpolation.PlannerOptions(knots=[0, 0.5, 0.6, 2]))
    ... except KnotError as error:
    ...     print(error.waypoint_index, error.interval)
    1 (1.0, 2.0)

    Attributes:
        waypoint_index: Index of the waypoint, or `None`.
        interval: Open interval of accepted knot times [s], or `None`.
    """

    waypoint_index: int | None = None
    interval: tuple[float, float] | None = None


class TimeRangeError(InputError):
    """A curve evaluated outside its time range.

    Attributes:
        time: The first time outside [s].
        start_time, end_time: Time range of the curve [s].
    """

    def __init__(self, time: float, start_time: float, end_time: float) -> None:
        self.time, self.start_time, self.end_time = time, start_time, end_time
        super().__init__(
            f"time {time:.15g} s is outside the curve, which is defined from "
            f"{start_time:.15g} s to {end_time:.15g} s and is not extrapolated"
        )


class ExportError(InputError):
    """A motion that a format can't represent without loss.

    >>> from knotwork.files import export
    >>> try:
    ...     export.to_pvt(kw.plan("paper_case", planner="quintic").trajectory)
    ... except ExportError as error:
    ...     print(error.joint, round(error.error, 4))
    joint_1 0.0777

    Attributes:
        joint: Joint with the largest error, or `None`.
        error: The largest error [rad or m; rad/s or m/s for a velocity jump], or `None`.
        time: Time of the largest error [s], or `None`.
    """

    joint: str | None = None
    error: float | None = None
    time: float | None = None


class CollisionError(InputError):
    """A collision of the robot with its surroundings at the start.

    Attributes:
        bodies: Names of the object and of the link.
        shortfall: Missing distance between them, from the required clearance [m].
    """

    bodies: Sequence[str] = ()
    shortfall: float = 0.0
    depth = OldAttribute("shortfall")


class CheckFailedError(KnotworkError, AssertionError):
    """A trajectory that does not meet the requirements of its scenario.

    >>> lift = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 1}]
    >>> report = kw.plan({"limits": {"velocity": 1}, "waypoints": lift}).report
    >>> try:
    ...     report.raise_if_failed()
    ... except kw.CheckFailedError as error:
    ...     print(error.report.counts)
    (8, 9)

    Attributes:
        report: The `knotwork.verification.Report` with every requirement and the achieved value.
    """

    def __init__(self, report: Any, message: str) -> None:
        self.report = report
        super().__init__(message)
