"""The examples in docstrings (`>>>`) print what they show.

They know the names of their module, `kw` and `np`.
"""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw

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
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=FLAGS)
    for example in examples:
        runner.run(example, out=said.append)
    assert not runner.failures, "".join(said)
    # An example where doctest does not look, as below a constant, would never be run.
    assert runner.tries == WITH_EXAMPLES[module], f"not all examples of {module} are found"


# Base classes that nobody makes by hand.
OBVIOUS = {"KnotworkError", "InputError", "Curve"}


@pytest.mark.parametrize("package", ["", ".tool_paths", ".kinematics", ".robot", ".verification"])
def test_public_names_have_examples(package: str) -> None:
    public = importlib.import_module(f"knotwork{package}")
    without = {name for name in public.__all__ if not shows_use(getattr(public, name))}
    assert without <= OBVIOUS


def shows_use(thing: object) -> bool:
    """Whether the docstring of a function or class, or of a method, has an example."""
    if not (inspect.isclass(thing) or inspect.isfunction(thing)):
        return True
    documented = [thing, *(vars(thing).values() if inspect.isclass(thing) else ())]
    return any(PROMPT.search(inspect.getdoc(one) or "") for one in documented)
