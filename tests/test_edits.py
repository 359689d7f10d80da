"""Values put into the text of a YAML file: what is written is what is read, all else stays."""

from __future__ import annotations

import re
from typing import Any

import pytest
import yaml
from hypothesis import assume, given
from hypothesis import strategies as st

from hostile.mutations import places
from knotwork.errors import InputError
from knotwork.files.documents import REMOVED, Document, apply_edits, parse, with_values
from knotwork.files.documents.edits import with_change
from sweeps import examples

TEXT = """\
# Above.
times: fastest # chosen
# Before the units.
units: {angle: deg}

waypoints:
  # first
  - name: A   # here
    joints: {a: 0,
             b: 1}
  - {name: B, joints: {a: 30}, after: {fastest: true}} # flow
  - after:
      fastest: true
      at_least: 0.5
    velocity: "free"  # via
# The end.
"""


def test_everything_else_stays_to_the_letter() -> None:
    edits = {
        ("times",): REMOVED,
        ("waypoints", 0, "after"): 0.25,
        ("waypoints", 1, "after"): 1 / 3,
        ("waypoints", 2, "after"): 1e-5,
        ("waypoints", 2, "velocity"): {"a": -1.5, "b": 2},
        ("chosen",): [{"times": [0.0, 0.5], "velocities": {"by the way, on": {"a": 1.0}}}],
    }
    assert with_values(TEXT, edits) == (
        TEXT.replace("times: fastest # chosen", "# chosen")
        .replace("joints: {a: 0,", "after: 0.25\n    joints: {a: 0,")
        .replace("{fastest: true}", "0.3333333333333333")
        .replace("fastest: true\n      at_least: 0.5", "1.0e-05")
        .replace('"free"', "{a: -1.5, b: 2}")
        .replace(
            "# The end.\n",
            "# The end.\n"
            "chosen:\n"
            "  - times: [0.0, 0.5]\n"
            "    velocities:\n"
            "      by the way, on: {a: 1.0}\n",
        )
    )


PLAIN = (
    st.none()
    | st.booleans()
    | st.integers(-9, 9)
    | st.floats(-1e6, 1e6)
    | st.text("aß: #'\"\n", max_size=5)
)
DATA = st.dictionaries(
    st.text("abc #:", min_size=1, max_size=3),
    st.recursive(
        PLAIN,
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(st.sampled_from(["x", "y", "z"]), inner, max_size=3)
        ),
        max_leaves=8,
    ),
    min_size=1,
    max_size=4,
)


@pytest.mark.parametrize("commented", [True, False])
@examples()
@given(st.data(), DATA, st.sampled_from([True, False, None]))
def test_what_is_written_is_what_is_read(
    commented: bool, data: Any, content: Any, flow: bool | None
) -> None:
    width = 20 if commented else 80
    plain = yaml.safe_dump(
        content, default_flow_style=flow, allow_unicode=True, width=width, sort_keys=False
    )
    lines = plain.splitlines() if commented else []
    text = "".join(f"{line} # {i}:\n" for i, line in enumerate(lines)) or plain
    try:
        found = parse(text)
        assume(found.data == parse(plain).data)  # no comment is in a text of several lines
    except InputError:
        return
    place = data.draw(st.sampled_from(list(places(found.data))))
    mapping = not isinstance(place[-1], int)
    value = data.draw(st.floats(-1e9, 1e9) | st.just(REMOVED) if mapping else st.floats(-1e9, 1e9))
    edits: dict[Any, Any] = {place: value}
    if mapping and data.draw(st.booleans()):
        edits[(*place[:-1], "new")] = {"a": [1.5, 2.5] * data.draw(st.integers(1, 20)), "b": 1e-7}
    wanted = apply_edits(Document(found.data), edits).data
    try:
        result = with_values(text, edits)
    except InputError:
        # refused rather than written wrong: a block can't be left without a key
        for key in place[:-1]:
            wanted = wanted[key]
        assert value is REMOVED
        assert len(wanted) == len(edits) - 1
        return
    assert parse(result).data == wanted
    kept = re.findall(r"# (\d+):$", result, re.MULTILINE)
    assert sorted(map(int, kept)) == list(range(len(lines)))


@pytest.mark.parametrize("flow", [True, False])
@examples()
@given(st.lists(PLAIN | st.dictionaries(st.sampled_from("xyz"), PLAIN), min_size=1), st.data())
def test_items_are_put_in_and_taken_out(flow: bool, items: list[Any], data: Any) -> None:
    text = yaml.safe_dump({"a": items}, default_flow_style=flow, allow_unicode=True, width=1000)
    try:
        assume(parse(text).data == {"a": items})
    except InputError:
        return
    if not flow:  # behind each line that ends an item, and above all
        text = f"# above\n{text}# below\n"
    i = data.draw(st.integers(0, len(items)))
    more = with_change(text, ("a", i), {"x": 0.5, "y": [1, 2]}, insert=True)
    assert parse(more).data == {"a": [*items[:i], {"x": 0.5, "y": [1, 2]}, *items[i:]]}
    less = with_change(more, ("a", i), REMOVED)
    assert parse(less).data == {"a": items}
    assert [line for line in less.splitlines() if "#" in line] == [
        line for line in text.splitlines() if "#" in line
    ]


@pytest.mark.parametrize(
    ("place", "value", "insert", "wanted"),
    [
        (("b", "c"), 1, False, "a: [1] # it\nb: {c: 1}\n"),  # what is around it is made
        (("b",), 2, True, None),
        (("a", 2), 2, False, None),
        (("a", 0), REMOVED, False, "a: [] # it\n"),
        (("a", "x"), 1, False, None),
        (("b",), REMOVED, False, None),
    ],
)
def test_change_needs_place(place: Any, value: Any, insert: bool, wanted: str | None) -> None:
    text = "a: [1] # it\n"
    if wanted is None:
        with pytest.raises(InputError, match="no such field"):
            with_change(text, place, value, insert=insert)
    else:
        assert with_change(text, place, value, insert=insert) == wanted


ALIASES = """\
waypoints:
  - {pose: &p {at: [0, 0, 60]}, time: 2} # first
  - {pose: *p, after: 1} # second
"""


@pytest.mark.parametrize(
    "place", [("waypoints", 0, "pose", "at", 0), ("waypoints", 1, "pose", "at")]
)
def test_a_part_that_an_alias_shares_is_not_changed(place: Any) -> None:
    with pytest.raises(InputError, match=r"write out aliases \(\*\)"):
        with_change(ALIASES, place, 5)
    assert with_change(ALIASES, ("waypoints", 1, "after"), 3) == ALIASES.replace(
        "after: 1", "after: 3"
    )
