"""YAML in, validated models out: scalars, structure, lines and fields of every problem."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import assume, example, given
from hypothesis import strategies as st

from knotwork.errors import DocumentError, KnotworkError, Problem
from knotwork.files import documents
from knotwork.task import Task
from knotwork.task.scenario import Scenario, load_scenario
from sweeps import examples
from texts import written


def refused(text: str) -> DocumentError:
    with pytest.raises(DocumentError) as caught:
        documents.parse(text)
    return caught.value


# Scalars


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3),
        ("-1.5e+2", -150.0),
        ("+7", 7),
        ("012", 12),  # YAML 1.1 would say 10
        ("0o17", 15),
        ("0x1F", 31),
        ("1_000", "1_000"),  # YAML 1.1 would say 1000
        ("12:30", "12:30"),  # YAML 1.1 would say 750
        ("2026-01-01", "2026-01-01"),  # YAML 1.1 would make a date
        ("on", "on"),
        ("y", "y"),
        ("true", True),
        ("tRUE", "tRUE"),
        ("null", None),
        ("", None),
        (".inf", math.inf),
        ("inf", "inf"),
        ("1e", "1e"),
        ("'1'", "1"),
        ('"true"', "true"),
        ("<<", "<<"),
    ],
)
def test_plain_scalars_are_those_of_yaml_1_2(text: str, value: Any) -> None:
    read = documents.parse(f"key: {text}\n").data["key"]
    assert read == value
    assert type(read) is type(value)


def test_nan_is_a_number_of_yaml() -> None:
    assert np.isnan(documents.parse("key: [.nan, .NaN, .NAN]").data["key"]).all()


# Structure


def test_anchors_and_aliases_give_the_same_data_in_both_places() -> None:
    document = documents.parse("a: &here\n  x: [1, 2]\nb: *here\n")
    assert document.data == {"a": {"x": [1, 2]}, "b": {"x": [1, 2]}}
    assert document.line(("b",)) == 3
    assert document.line(("b", "x", 1)) == 2


def test_lines_of_parts_that_share_one() -> None:
    text = "rows:\n- [1, 2,\n   3]\n- {a: 4, b:\n    5}\nrow: {c: [6]}\n"
    document = documents.parse(text)
    places = {
        ("rows",): 1,
        ("rows", 0): 2,
        ("rows", 0, 1): 2,
        ("rows", 0, 2): 3,
        ("rows", 1, "b"): 4,
        ("row", "c", 0): 6,
    }
    assert {place: document.line(place) for place in places} == places
    part = document.part(("rows", 0))
    assert (part.line(()), part.line((1,)), part.line((2,))) == (2, 2, 3)
    assert document.part(("row", "c", 0)).line(()) == 6


def test_part_of_copied_data_is_located_in_its_original() -> None:
    document = documents.parse("rows:\n  - a: 1\n    b: [2, 3]\n  - c: 4\n")
    copies = {("rows", 2): ("rows", 0), ("rows", 3): ("rows", 1)}
    located = replace(document, origins=copies)
    copied = located.document({"a": 1, "b": [2, 3]}, ("rows", 2))
    assert copied.where(("b", 1)) == "line 3: rows[0].b[1]"
    assert located.document([], ("rows",)).where((3, "c")) == "line 4: rows[1].c"


def problems_of(error: DocumentError) -> list[tuple[int | None, str]]:
    return [(problem.line, problem.field) for problem in error.problems]


def test_keys_given_twice_are_all_named_with_both_lines() -> None:
    error = refused("a: 1\nb:\n  c: 1\n  d: 2\n  c: 3\na: 2\n")
    assert problems_of(error) == [(5, "b.c"), (6, "a")]
    assert "first in line 3" in str(error)
    assert "first in line 1" in str(error)


def test_keys_are_text() -> None:
    assert documents.parse("1: a\ntrue: b\nnull: c\n").data == {"1": "a", "true": "b", "null": "c"}


BILLION = [
    "a0: &a0 [x, x, x, x, x, x, x, x, x, x]",
    *(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)),
]
INVALID = "is not valid YAML"


@pytest.mark.parametrize(
    ("text", "line", "fault"),
    [
        ("a: 1\nb: " + "9" * 5000, 2, "b: has 5000 digits"),
        ("a: &x [1, *x]", 1, "nested"),
        ("\n".join(BILLION), 1, "its aliases repeat more than 1000000 values"),
        ("[" * 100_000, 1, "nested"),
        ("a: " + "[{b: " * 100_000, 1, "nested"),
        ("\n".join(" " * i + "a:" for i in range(400)), 101, "nested"),
        *(
            (f"a: 1\nb: {tag} x\n", 2, "b: has the tag")
            for tag in ("!thing", "!!python/object:os.system", "!!binary", "!!set")
        ),
        ("a:\n  ? [1, 2]\n  : 3\n", 2, "a: has a key that is not plain text"),
        ("a: 1\nb: [1, 2\nc: 3\n", 3, INVALID),
        ("a: 'open\nb: 1\n", 3, INVALID),
        ("a: *nowhere\n", 1, INVALID),
        ("a: 1\n---\nb: 2\n", 2, INVALID),
        ("a: \x00", None, INVALID),
        ("a: \ud800", 1, "half a character"),
        (r'{"name": "\ud83d"}', 1, INVALID),
    ],
)
def test_text_that_is_no_document_is_refused(text: str, line: int | None, fault: str) -> None:
    error = refused(text)
    assert fault in str(error)
    assert error.problems[0].line == line
    assert len(str(error)) < 300


@pytest.mark.parametrize("text", ["", "\n\n", "# nothing\n", "---\n"])
def test_an_empty_file_says_so(text: str, tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match=r"empty\.yaml: .*(empty|a mapping of keys)"):
        load_scenario(written(tmp_path / "empty.yaml", text))


def test_a_file_that_is_not_utf_8_says_where(tmp_path: Path) -> None:
    path = written(tmp_path / "latin.yaml", "description: Fräse\n".encode("latin-1"))
    with pytest.raises(DocumentError, match=r"latin\.yaml: is not UTF-8 text \(byte 15\)"):
        documents.read(path)


def test_a_byte_order_mark_is_no_part_of_the_first_key(tmp_path: Path) -> None:
    path = written(tmp_path / "marked.yaml", b"\xef\xbb\xbfa: 1\n")
    assert documents.read(path).data == {"a": 1}


def test_a_folder_or_missing_file_can_not_be_read(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.yaml"):
        with pytest.raises(DocumentError, match="can't be read"):
            documents.read(path)


# Validation


FAULTY = """\
robot: ur5
limits:
  velocity: big
  acceleration: {elbow_joint: -1}
scene:
  objects:
    table: {box: [1, 2]}
    post:
      cylinder: {radius: 0.1, lenght: 1}
frames:
  part: {position: [0, true, 0]}
waypoints:
  - joints: home
    velocty: {elbow_joint: 1}
  - pose: {position: [0, 0, .nan]}
nmae: x
"""


def test_every_problem_is_reported_in_the_order_of_the_file() -> None:
    with pytest.raises(DocumentError) as caught:
        documents.validate(Task, documents.parse(FAULTY, Path("folder/task.yaml")))
    assert problems_of(caught.value) == [
        (3, "limits.velocity"),
        (4, "limits.acceleration.elbow_joint"),
        (7, "scene.objects.table.box"),
        (9, "scene.objects.post.cylinder.length"),
        (9, "scene.objects.post.cylinder.lenght"),
        (11, "frames.part.position[1]"),
        (14, "waypoints[0].velocty"),
        (15, "waypoints[1].pose.position[2]"),
        (16, "nmae"),
    ]
    text = str(caught.value)
    assert all(line.startswith("folder/task.yaml: ") for line in text.splitlines())
    for words in (
        "'big': must be a positive number",
        "-1: must be greater than 0",
        "length: is missing and must be given",
        "did you mean 'length'?",
        "true: must be a number",
        "did you mean 'velocity'?",
        "did you mean 'name'?",
    ):
        assert words in text


# Whatever comes in, either a scenario or an error of ours comes out.

SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.sampled_from([10**400, 2**63, 5e-324, 1.7e308, -1.7e308, 1e200, 0, 1]),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(["base", "tool", "home", "ur5", "deg", "mm", "zero", "paper", "ZYX", "\ud800"]),
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=20,
)


def scenario_or_error(reference: Any) -> None:
    try:
        scenario = load_scenario(reference)
    except KnotworkError as error:
        str(error).encode("utf-8")  # a message that can be printed
    else:
        assert isinstance(scenario, Scenario)
        assert np.isfinite(scenario.times).all()


def test_a_mapping_that_holds_itself_is_an_error() -> None:
    mapping: dict[str, Any] = {"waypoints": []}
    mapping["frames"] = mapping
    mapping["robot"] = mapping
    with pytest.raises(KnotworkError):
        load_scenario(mapping)


def test_a_deeply_nested_mapping_is_an_error() -> None:
    value: Any = 0
    for _ in range(5000):
        value = {"a": [value]}
    for nested in ({"waypoints": value}, {"robot": value, "waypoints": [{"joints": {"a": 0}}]}):
        with pytest.raises(KnotworkError):
            load_scenario(nested)


@examples(in_all=460)
@given(st.text(max_size=60))
@example("&a [*a]")
@example("? {a: 1}\n: b")
@example("!!float 1_0")
@example("!!int ''")
@example("!!bool maybe")
@example("!!null x")
@example("a: !!timestamp 2026-01-01")
@example("%YAML 3.0\n---\na")
@example("\ufeffwaypoints: []")
def test_any_text_gives_a_document_or_an_error(text: str) -> None:
    try:
        document = documents.parse(text)
    except KnotworkError as error:
        str(error).encode("utf-8")
    else:
        scenario_or_error(document.data if isinstance(document.data, dict) else {})


@examples()
@given(VALUES)
def test_yaml_is_read_as_another_library_reads_it_or_is_an_error(value: Any) -> None:
    text = yaml.safe_dump({"key": value}, allow_unicode=True)
    # 0E0 is a number of YAML 1.2 and a text of PyYAML's YAML 1.1
    assume(not re.search(r"[0-9]+[eE][0-9]|(?<![0-9.])[0-9]+[eE]", text))
    try:
        document = documents.parse(text)
    except KnotworkError as error:
        str(error).encode("utf-8")
    else:
        assert repr(document.data) == repr(yaml.safe_load(text))  # NaN is not itself


def test_many_problems_are_reported_in_few_lines() -> None:
    """A file of a hundred thousand faults must not take minutes, nor fill the terminal."""
    data = {"waypoints": [{"joints": {"a": 0}, "speedy": 1}] * 20_000}
    with pytest.raises(DocumentError) as caught:
        load_scenario(data)
    lines = str(caught.value).splitlines()
    assert len(lines) == 51
    assert lines[-1] == "and at least 950 more problems"
    problems = [Problem(None, "", "")] * 51
    assert str(DocumentError("a.yaml", problems)).endswith("\na.yaml: and 1 more problem")


def test_a_file_of_more_values_than_are_read_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each takes hundreds of bytes while it is read."""
    monkeypatch.setattr("knotwork.files.documents.yaml_text.MAX_YAML_VALUES", 100)
    documents.parse(f"[{'1,' * 98}]")
    with pytest.raises(DocumentError, match="has more than 100 values"):
        documents.parse(f"[{'1,' * 100}]")
