"""The examples in docstrings (`>>>`) print what they show.

They know the names of their module, `kw` and `np`.
"""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
from collections.abc import Iterator
from dataclasses import is_dataclass
from pathlib import Path

import numpy as np
import pytest
from pydantic import BaseModel

import knotwork as kw
from knotwork.errors import KnotworkError
from public_names import documented

SOURCE = Path(kw.__file__).parent
PROMPT = re.compile(r"^\s*>>> ", re.MULTILINE)
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
WITH_EXAMPLES = {
    ".".join(["knotwork", *path.relative_to(SOURCE).with_suffix("").parts]): len(prompts)
    for path in sorted(SOURCE.rglob("*.py"))
    if (prompts := PROMPT.findall(path.read_text(encoding="utf-8")))
}


@pytest.fixture(autouse=True)
def surroundings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """An empty folder to work in, and NumPy's default way of printing."""
    monkeypatch.chdir(tmp_path)
    with np.printoptions(precision=8, suppress=False, floatmode="maxprec", linewidth=75):
        yield


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_of_docstrings(module: str) -> None:
    examples = doctest.DocTestFinder(exclude_empty=True).find(
        importlib.import_module(module.removesuffix(".__init__")),
        extraglobs={"np": np, "kw": kw},
    )
    output: list[str] = []
    runner = doctest.DocTestRunner(optionflags=FLAGS)
    for example in examples:
        runner.run(example, out=output.append)
    assert not runner.failures, "".join(output)
    # An example where doctest does not look, as below a constant, would never be run.
    assert runner.tries == WITH_EXAMPLES[module], f"not all examples of {module} are found"


WITHOUT_EXAMPLES = {
    "curves.tool_paths.Curve",
    "files.export.to_drake",
    "files.export.to_ros2_message",
    "view.page.Page",
}
"""A base class, what needs Drake or ROS 2, and what `report_page` gives."""


def test_public_names_have_examples() -> None:
    shown = {name.removeprefix("knotwork."): shows_use(public(name)) for name in documented()}
    assert {name for name, example in shown.items() if not example} == WITHOUT_EXAMPLES


def public(name: str) -> object:
    package, _, own = name.rpartition(".")
    return getattr(importlib.import_module(package), own)


def shows_use(thing: object) -> bool:
    """Whether the docstring of a function or class, or of a method, has an example.

    Errors say all in their message, and of plain data what gives or takes it has the example.
    """
    if not (inspect.isclass(thing) or inspect.isfunction(thing)):
        return True
    if inspect.isclass(thing) and (
        issubclass(thing, BaseModel | KnotworkError | tuple | dict)
        or is_dataclass(thing)
        or getattr(thing, "_is_protocol", False)
    ):
        return True
    documented = [thing, *(vars(thing).values() if inspect.isclass(thing) else ())]
    return any(PROMPT.search(inspect.getdoc(one) or "") for one in documented)
