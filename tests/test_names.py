"""Names say what things are, and no two modules, classes or shared constants have one name."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from syntax_trees import FILES, SOURCE, tree_of

# The typed part of a task and what it becomes: both are public names.
TWICE = {"Arc"}
EMPTY = {"one", "ones", "found", "made", "told", "thing", "things", "what"}


def places(names: Iterator[tuple[str, Path]]) -> dict[str, set[str]]:
    """Modules of each name that more than one module has."""
    modules = defaultdict(set)
    for name, path in names:
        modules[name].add(str(path.relative_to(SOURCE)))
    return {name: paths for name, paths in modules.items() if len(paths) > 1}


def test_modules_have_names_of_their_own() -> None:
    named = ((path.stem, path) for path in FILES if path.stem not in ("__init__", "__main__"))
    assert sorted(places(named).items()) == []


def test_classes_have_names_of_their_own() -> None:
    named = (
        (node.name.lstrip("_"), path)
        for path in FILES
        for node in tree_of(path).body
        if isinstance(node, ast.ClassDef) and node.name not in TWICE
    )
    assert sorted(places(named).items()) == []


def test_shared_constants_have_names_of_their_own() -> None:
    imported = {
        alias.name
        for path in FILES
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    named = (
        (target.id, path)
        for path in FILES
        for node in tree_of(path).body
        if isinstance(node, ast.Assign | ast.AnnAssign)
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        for target in ast.walk(target)
        if isinstance(target, ast.Name) and target.id in imported and target.id.isupper()
    )
    assert sorted(places(named).items()) == []


def test_variables_are_nouns_that_say_something() -> None:
    empty = [
        f"{path.relative_to(SOURCE)}:{node.lineno}"
        for path in FILES
        for node in ast.walk(tree_of(path))
        if (isinstance(node, ast.Name) and node.id in EMPTY)
        or (isinstance(node, ast.arg) and node.arg in EMPTY)
    ]
    assert empty == []
