"""The examples in docstrings (`>>>`) print what they show.

They know the names of their module, `kw` and `np`.
"""

from __future__ import annotations

import doctest
import importlib
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


def test_there_are_examples() -> None:
    assert len(WITH_EXAMPLES) >= 1
