"""YAML text to plain data, with the line of each part, and plain data to YAML."""

from __future__ import annotations

import gc
import re
import typing
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from knotwork.errors import DocumentError, Problem, format_value
from knotwork.files.documents.document import Document, Location, Locations, field_path

MAX_YAML_DEPTH = 100
"""Maximum depth of a document, which the recursive parser bears; real documents are shallower."""
MAX_REPEATED = 1_000_000
"""Maximum number of values that aliases repeat.

Aliases of aliases can expand a short file beyond any memory.
"""
MAX_YAML_BYTES = 100_000_000
"""Maximum size of a file; one with a hundred thousand waypoints has a tenth of it."""
MAX_YAML_VALUES = 1_500_000
"""Maximum number of values: each may be wrong, and its report takes some 1,400 bytes."""
LINE_WIDTH = 100
"""Maximum length of the lines of new values, in characters."""
LAST_VALUE_WIDTH = 20
"""Space reserved in a line for its last value, before which PyYAML does not break the line."""


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
_FLOAT = _TAG + "float"
_PATTERNS = {_TAG + kind: re.compile(pattern) for kind, pattern, _ in _SCALARS}
for _kind, _, _first in _SCALARS:
    _Loader.add_implicit_resolver(_TAG + _kind, _PATTERNS[_TAG + _kind], list(_first))
_Loader.add_implicit_resolver(_TAG + "null", re.compile(r"^$"), [""])


class Dumper(yaml.SafeDumper):
    """Writes YAML that is read back unchanged; lists are indented below their key."""

    yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers

    def ignore_aliases(self, data: Any) -> bool:
        """Write out all aliases."""
        return True

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
        """Begin a collection."""
        super().increase_indent(flow, False)


class _Reader:
    """Turns a tree of YAML nodes into data, and records lines and problems.

    A line is recorded only if it differs from that of the enclosing part, because most numbers of a
    long file share a line. `Document` uses the line of the enclosing part for the others.
    """

    def __init__(self, file: Path | None, own_values: int) -> None:
        self.file = file
        self.max_values = own_values + MAX_REPEATED
        self.lines: dict[Location, int] = {}
        self.problems: list[Problem] = []
        self.values = 0

    def _problem(
        self, node: yaml.Node, location: Location, message: str, accepted: str = ""
    ) -> None:
        line = node.start_mark.line + 1
        self.problems.append(Problem(line, field_path(location), message, accepted))

    def read(self, node: yaml.Node, location: Location, above: int) -> Any:
        """Read a node; `above` is the line of the enclosing part, or of its key."""
        self.values += 1
        if self.values > self.max_values:
            message = f"its aliases repeat more than {MAX_REPEATED} values"
            accepted = "the values written out, or JSON"
            line = node.start_mark.line + 1
            raise DocumentError(self.file, [Problem(line, "", message, accepted)])
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, location)
        if len(location) > MAX_YAML_DEPTH:
            raise DocumentError(self.file, [_too_deep(node.start_mark.line + 1)])
        if node.tag not in (_TAG + "map", _TAG + "seq"):
            self._problem(node, location, f"has the tag {node.tag!r}", "plain values without tags")
            return None
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, location, above)
        items = ((child, (*location, i)) for i, child in enumerate(node.value))
        return [self.read(child, inner, self._note(child, inner, above)) for child, inner in items]

    def _note(self, node: yaml.Node, location: Location, above: int) -> int:
        line: int = node.start_mark.line + 1
        if line != above:
            self.lines[location] = line
        return line

    def _mapping(self, node: yaml.MappingNode, location: Location, above: int) -> dict[str, Any]:
        data: dict[str, Any] = {}
        lines: dict[str, int] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                self._problem(key_node, location, "has a key that is not plain text")
                continue
            key = str(key_node.value)
            if key in data:
                message = f"is given twice, first in line {lines[key]}"
                self._problem(key_node, (*location, key), message)
                continue
            inner = (*location, key)
            lines[key] = self._note(key_node, inner, above)
            data[key] = self.read(value_node, inner, lines[key])
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
            self._problem(
                node, location, f"{format_value(text)} is tagged as {kind}, which it is not"
            )
            return None
        if tag == _TAG + "null":
            return None
        if tag == _TAG + "bool":
            return text.lower() == "true"
        if tag == _FLOAT:
            return float(text if text[-1] not in "fFnN" else text.replace(".", ""))
        try:
            return int(text, 0) if text[:2] in ("0o", "0x") else int(text)
        except ValueError:  # Python reads at most some thousands of digits
            self._problem(node, location, f"has {len(text)} digits, which is too many")
            return None


def parse(text: str, file: Path | None = None) -> Document:
    """Parse YAML text.

    Raises:
        DocumentError: The text is not YAML, is empty, gives a key twice, or is nested too deep.
    """
    try:
        values = _checked_size(text, file)
        with _no_collector():
            node = yaml.compose(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise DocumentError(file, [_syntax_problem(error, text)]) from error
    except UnicodeEncodeError as error:
        line = text.count("\n", 0, error.start) + 1
        message = f"is not valid YAML: {text[error.start]!a} is half a character"
        raise DocumentError(file, [Problem(line, "", message)]) from error
    if node is None:
        raise Locations(file=file).error((), "the file is empty")
    reader = _Reader(file, values)
    with _no_collector():
        first = node.start_mark.line + 1
        reader.lines[()] = first
        data = reader.read(node, (), first)
    if reader.problems:
        raise DocumentError(file, reader.problems)
    return Document(data, file=file, lines=reader.lines)


@contextmanager
def _no_collector() -> Iterator[None]:
    """Suspend Python's cyclic garbage collection.

    It would search millions of new objects repeatedly, which takes longer than creating them.
    """
    running = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if running:
            gc.enable()


def _checked_size(text: str, file: Path | None) -> int:
    """Count the values of a text, without aliases.

    Refuse deep nesting before the parser, which would crash on it.

    Raises:
        DocumentError: The text is nested too deep, or holds too many values.
        yaml.YAMLError: The text is not YAML.
    """
    depth = values = 0
    for event in yaml.parse(text, Loader=_Loader):
        if isinstance(event, yaml.ScalarEvent):
            values += 1
        elif isinstance(event, yaml.CollectionStartEvent):
            depth, values = depth + 1, values + 1
            if depth > MAX_YAML_DEPTH:
                line = event.start_mark.line + 1 if event.start_mark is not None else None
                raise DocumentError(file, [_too_deep(line)])
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if values > MAX_YAML_VALUES:
            raise Locations(file=file).error((), f"has more than {MAX_YAML_VALUES} values")
    return values


def _too_deep(line: int | None) -> Problem:
    return Problem(line, "", f"is nested more than {MAX_YAML_DEPTH} levels deep")


def _syntax_problem(error: yaml.YAMLError, text: str) -> Problem:
    if isinstance(error, yaml.MarkedYAMLError):
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark is not None else None
        at = "".join(text.splitlines()[mark.line : mark.line + 1]) if mark is not None else ""
        if "\t" in at[: len(at) - len(at.lstrip())]:
            message = "is not valid YAML: there is a tab; lines are indented by spaces alone"
            return Problem(line, "", message)
        reason = ", ".join(part for part in (error.context, error.problem) if part)
        return Problem(line, "", f"is not valid YAML: {reason}")
    return Problem(None, "", f"is not valid YAML: {error}".replace("\n", " "))


def read(path: Path) -> Document:
    """Read a YAML file.

    Raises:
        DocumentError: The file can't be read, or as for `parse`.
    """
    return parse(read_text(path), path)


def read_text(path: Path, max_bytes: int = MAX_YAML_BYTES) -> str:
    """Read a text file in UTF-8, with or without a byte order mark.

    Args:
        path: The file.
        max_bytes: Files of more bytes are refused.

    Raises:
        DocumentError: The file can't be read, is too large or is not UTF-8 text.
    """
    whole = Locations(file=path)
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):
            # a pipe may never end, and /dev/zero does not either
            accepted = "a file; write a pipe's output to one"
            raise whole.error((), "is not a regular file", accepted)
        if path.is_file() and (size := path.stat().st_size) > max_bytes:
            raise whole.error((), f"has {size} bytes, and at most {max_bytes} are read")
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise whole.error((), f"is not UTF-8 text (byte {error.start})") from error
    except OSError as error:
        raise whole.error((), f"can't be read: {error.strerror or error}") from error


def to_flow_yaml(value: Any, column: int = 0, width: int = LINE_WIDTH) -> str:
    """Plain data in YAML's flow style, in lines that begin right of a column."""
    text = _dump_yaml([value], default_flow_style=True, width=width - column - LAST_VALUE_WIDTH)
    return text.strip()[1:-1].replace("\n  ", "\n" + " " * column)


def to_block_yaml(value: Mapping[str, Any]) -> str:
    """Plain data in YAML's block style; parts without nested parts in flow style."""
    styles = {
        key: None if isinstance(part, Mapping | list) else False for key, part in value.items()
    }
    return "".join(
        _dump_yaml({key: part}, default_flow_style=styles[key], width=LINE_WIDTH - LAST_VALUE_WIDTH)
        for key, part in value.items()
    )


def _dump_yaml(value: Any, **style: Any) -> str:
    return str(yaml.dump(value, Dumper=Dumper, sort_keys=False, allow_unicode=True, **style))
