"""A YAML file or a mapping in, a validated model out; every problem with its line and field.

Files are YAML 1.2 (core schema): `1e-3` is a number, `on` is text, and a key given twice is an
error.
"""

from __future__ import annotations

import re
import types
import typing
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from knotwork.errors import DocumentError, Problem, did_you_mean

Location = tuple[str | int, ...]
ModelT = TypeVar("ModelT", bound="StrictModel")

# Deeper than any document of ours, and shallow enough for the parser, which is recursive.
MOST_NESTED = 100
# Aliases of aliases can make a short file hold more than any memory.
MOST_VALUES = 1_000_000

# Fields take what they say and convert nothing: text is no number, `true` is no 1.
Number = Annotated[float, Field(strict=True)]
Positive = Annotated[float, Field(strict=True, gt=0)]
Text = Annotated[str, Field(strict=True, min_length=1)]


class StrictModel(BaseModel):
    """A part of a document: unknown keys are errors, and values are frozen once read."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, arbitrary_types_allowed=True
    )


@dataclass(frozen=True)
class Document:
    """Plain data, and where in the file each part of it stands.

    Attributes:
        data: Mappings, lists, text, numbers, booleans and `None`.
        file: The file it came from, or `None`.
        lines: Line, counted from 1, of each location.
        prefix: Location of the data in the file, where it is a part of one.
    """

    data: Any
    file: Path | None = None
    lines: Mapping[Location, int] = field(default_factory=dict)
    prefix: Location = ()

    def part(self, location: Location) -> Document:
        """Take a part as a document of its own that still knows where in the file it stands."""
        data = self.data
        for key in location:
            data = data[key]
        size = len(location)
        lines = {key[size:]: line for key, line in self.lines.items() if key[:size] == location}
        return Document(data, self.file, lines, self.prefix + location)

    def path(self, location: Location) -> str:
        """Field path of a location in the whole file."""
        return field_path(self.prefix + location)

    def line(self, location: Location) -> int | None:
        """Line of a location, or of the nearest part around it that has one."""
        while location and location not in self.lines:
            location = location[:-1]
        return self.lines.get(location)

    def where(self, location: Location) -> str:
        """Say where a location is, for example `task.yaml: line 12: waypoints[2].time`."""
        line = self.line(location)
        file = str(self.file) if self.file is not None else ""
        place = f"line {line}" if line is not None else ""
        return ": ".join(part for part in (file, place, self.path(location)) if part)

    def error(self, location: Location, message: str, accepted: str = "") -> DocumentError:
        """Make the error for one problem at a location."""
        problem = Problem(self.line(location), self.path(location), message, accepted)
        return DocumentError(self.file, [problem])


def field_path(location: Iterable[str | int]) -> str:
    """Write a location as a field path, for example `waypoints[2].time`."""
    path = ""
    for part in location:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else str(part)
    return path


class _Loader(yaml.CSafeLoader if hasattr(yaml, "CSafeLoader") else yaml.SafeLoader):  # type: ignore[misc]
    """PyYAML's safe loader with the scalars of YAML 1.2's core schema instead of YAML 1.1's."""

    yaml_implicit_resolvers: typing.ClassVar[dict[str, list[Any]]] = {}


_TAG = "tag:yaml.org,2002:"
_SCALARS: tuple[tuple[str, str, str], ...] = (
    ("null", r"^(?:~|null|Null|NULL|)$", "~nN"),
    ("bool", r"^(?:true|True|TRUE|false|False|FALSE)$", "tTfF"),
    ("int", r"^(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)$", "-+0123456789"),
    (
        "float",
        r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
        r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$",
        "-+.0123456789",
    ),
)
_PATTERNS = {_TAG + kind: re.compile(pattern) for kind, pattern, _ in _SCALARS}
for _kind, _, _first in _SCALARS:
    _Loader.add_implicit_resolver(_TAG + _kind, _PATTERNS[_TAG + _kind], list(_first))
_Loader.add_implicit_resolver(_TAG + "null", re.compile(r"^$"), [""])


class _Reader:
    """Turns a tree of YAML nodes into a `Document`'s data and lines."""

    def __init__(self, file: Path | None) -> None:
        self.file = file
        self.lines: dict[Location, int] = {}
        self.problems: list[Problem] = []
        self.open: set[int] = set()
        self.values = 0

    def _problem(self, node: yaml.Node, location: Location, message: str, hint: str = "") -> None:
        line = node.start_mark.line + 1
        self.problems.append(Problem(line, field_path(location), message, hint))

    def read(self, node: yaml.Node, location: Location) -> Any:
        line = node.start_mark.line + 1
        self.lines.setdefault(location, line)
        self.values += 1
        if self.values > MOST_VALUES:
            message = f"its aliases make more than {MOST_VALUES} values"
            raise DocumentError(self.file, [Problem(line, "", message)])
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, location)
        if id(node) in self.open:
            self._problem(node, location, "refers to itself")
            return None
        if len(location) > MOST_NESTED:
            raise DocumentError(self.file, [_too_deep(line)])
        if node.tag not in (_TAG + "map", _TAG + "seq"):
            self._problem(node, location, f"has the tag {node.tag!r}", "plain values without tags")
            return None
        self.open.add(id(node))
        try:
            if isinstance(node, yaml.MappingNode):
                return self._mapping(node, location)
            return [self.read(child, (*location, i)) for i, child in enumerate(node.value)]
        finally:
            self.open.discard(id(node))

    def _mapping(self, node: yaml.MappingNode, location: Location) -> dict[str, Any]:
        data: dict[str, Any] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                self._problem(key_node, location, "has a key that is no plain text")
                continue
            key = str(key_node.value)
            if key in data:
                first = self.lines[(*location, key)]
                self._problem(key_node, (*location, key), f"is given twice, first in line {first}")
                continue
            self.lines[(*location, key)] = key_node.start_mark.line + 1
            data[key] = self.read(value_node, (*location, key))
        return data

    def _scalar(self, node: yaml.ScalarNode, location: Location) -> Any:
        tag, text = node.tag, node.value
        if tag == _TAG + "str":
            return text
        if tag not in _PATTERNS:
            self._problem(node, location, f"has the tag {tag!r}", "plain values without tags")
            return None
        if not _PATTERNS[tag].match(text):
            kind = tag.removeprefix(_TAG)
            self._problem(node, location, f"{_shown(text)} is tagged as {kind}, which it is not")
            return None
        if tag == _TAG + "null":
            return None
        if tag == _TAG + "bool":
            return text.lower() == "true"
        if tag == _TAG + "float":
            return float(re.sub(r"^([-+]?)\.(inf|nan)$", r"\1\2", text.lower()))
        try:
            return int(text, 0) if text[:2] in ("0o", "0x") else int(text)
        except ValueError:  # Python reads no more than some thousands of digits
            self._problem(node, location, f"has {len(text)} digits, which is too many")
            return None


def parse(text: str, file: Path | None = None) -> Document:
    """Parse YAML text.

    Raises:
        DocumentError: The text is no YAML, is empty, gives a key twice, or is nested too deep.
    """
    try:
        _check_depth(text, file)
        node = yaml.compose(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise DocumentError(file, [_syntax_problem(error)]) from error
    except UnicodeEncodeError as error:
        line = text.count("\n", 0, error.start) + 1
        message = f"is not valid YAML: {text[error.start]!a} is half a character"
        raise DocumentError(file, [Problem(line, "", message)]) from error
    if node is None:
        raise DocumentError(file, [Problem(None, "", "the file is empty")])
    reader = _Reader(file)
    data = reader.read(node, ())
    if reader.problems:
        raise DocumentError(file, reader.problems)
    return Document(data, file, reader.lines)


def _check_depth(text: str, file: Path | None) -> None:
    """Refuse deep nesting before the parser, which crashes on it, makes a tree of the text.

    Raises:
        DocumentError: The text is nested too deep.
        yaml.YAMLError: It is no YAML.
    """
    depth = 0
    for event in yaml.parse(text, Loader=_Loader):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MOST_NESTED:
                line = event.start_mark.line + 1 if event.start_mark is not None else None
                raise DocumentError(file, [_too_deep(line)])
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1


def _too_deep(line: int | None) -> Problem:
    return Problem(line, "", f"is nested more than {MOST_NESTED} levels deep")


def _syntax_problem(error: yaml.YAMLError) -> Problem:
    if isinstance(error, yaml.MarkedYAMLError):
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark is not None else None
        said = ", ".join(part for part in (error.context, error.problem) if part)
        return Problem(line, "", f"is not valid YAML: {said}")
    return Problem(None, "", f"is not valid YAML: {error}".replace("\n", " "))


def read(path: Path) -> Document:
    """Read a YAML file.

    Raises:
        DocumentError: The file can't be read, or as for `parse`.
    """
    return parse(read_text(path), path)


def read_text(path: Path) -> str:
    """Read a text file in UTF-8.

    Raises:
        DocumentError: The file can't be read or is not UTF-8 text.
    """
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        message = f"is not UTF-8 text (byte {error.start})"
        raise DocumentError(path, [Problem(None, "", message)]) from error
    except OSError as error:
        message = f"can't be read: {error.strerror or error}"
        raise DocumentError(path, [Problem(None, "", message)]) from error


def validate(model: type[ModelT], document: Document) -> ModelT:
    """Check a document against a model and return the model's instance.

    Raises:
        DocumentError: With every problem found.
    """
    if not isinstance(document.data, dict):
        kind = type(document.data).__name__
        raise document.error((), f"holds a single {kind}", "a mapping of keys to values")
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        problems = [_problem(model, document, dict(item)) for item in error.errors()]
        problems.sort(key=lambda problem: problem.line or 0)
        raise DocumentError(document.file, list(dict.fromkeys(problems))) from None


def _problem(model: type[BaseModel], document: Document, item: dict[str, Any]) -> Problem:
    location, owners = _resolve(model, document.data, item["loc"])
    line, path = document.line(location), document.path(location)
    if item["type"] == "extra_forbidden":
        keys = sorted({key for owner in owners for key in _keys(owner)})
        return Problem(line, path, "unknown key", did_you_mean(location[-1], keys))
    if item["type"] == "missing":
        return Problem(line, path, "is missing and must be given")
    message = str(item["msg"]).removeprefix("Value error, ")
    message = message.replace("Input should be", "must be").replace("Input should", "must")
    value = item["input"]
    shown = "" if isinstance(value, (dict, list, BaseModel)) else f"{_shown(value)}: "
    return Problem(line, path, f"{shown}{message[:1].lower()}{message[1:]}")


def _shown(value: Any) -> str:
    try:
        text = repr(value)
    except ValueError:  # Python writes no more than some thousands of digits
        return "an integer of thousands of digits"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _resolve(
    model: type[BaseModel], data: Any, loc: tuple[str | int, ...]
) -> tuple[Location, list[type[BaseModel]]]:
    """Find the location that pydantic means, without the names it gives to parts of a union.

    Returns:
        The location in the data, and the models that may own its last key.
    """
    location: list[str | int] = []
    candidates: list[Any] = [model]
    owners: list[type[BaseModel]] = [model]
    for position, part in enumerate(loc):
        inside = (isinstance(data, dict) and part in data) or (
            isinstance(data, list) and isinstance(part, int) and part < len(data)
        )
        models = [owner for owner in _flatten(candidates) if _is_model(owner)]
        known = isinstance(data, dict) and any(part in _keys(owner) for owner in models)
        if not inside and not (known and position == len(loc) - 1):
            tagged = [owner for owner in models if owner.__name__ == part]
            candidates = tagged or candidates
            continue
        location.append(part)
        owners = models or owners
        candidates = _children(candidates, part)
        data = data[part] if inside else None
    return tuple(location), owners


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _keys(model: type[BaseModel]) -> list[str]:
    return [info.alias or name for name, info in model.model_fields.items()]


def _flatten(candidates: Iterable[Any]) -> list[Any]:
    """Open up unions and annotations."""
    flat: list[Any] = []
    for kind in candidates:
        origin = typing.get_origin(kind)
        if origin is typing.Annotated:
            inner: Iterable[Any] = typing.get_args(kind)
            flat += _flatten([next(iter(inner))])
        elif origin in (typing.Union, types.UnionType):
            flat += _flatten(typing.get_args(kind))
        else:
            flat.append(kind)
    return flat


def _children(candidates: Iterable[Any], part: str | int) -> list[Any]:
    """Types of what lies under a key or index of any of the candidate types."""
    children: list[Any] = []
    for kind in _flatten(candidates):
        if _is_model(kind):
            children += [
                info.annotation
                for name, info in kind.model_fields.items()
                if (info.alias or name) == part
            ]
        else:
            arguments = [item for item in typing.get_args(kind) if item is not Ellipsis]
            if typing.get_origin(kind) is dict and len(arguments) == 2:
                children.append(arguments[1])
            elif arguments:
                children += arguments if typing.get_origin(kind) is tuple else arguments[:1]
    return _flatten(children)
