"""What a reader of the package pays: lines, long modules and functions, names, words.

    python benchmarks/size.py

Lines of code are those without docstrings, comments and blank lines; a string below the assignment
of a constant is its docstring. Words of documentation are
those of the pages in docs, with their code and tables, but without the notebook, the API reference
and what the build of the site adds: outputs of commands and tables of keys. The pages of benchmarks
are rendered from stored results when the site is built; their words, most of them numbers in
tables, are counted apart.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import click
from rich.console import Console

import knotwork
import pages
from results import Table

ROOT = Path(__file__).parents[1]
LONG_MODULE, LONG_FUNCTION = 350, 60
RENDERED = "_benchmarks"
NO_CODE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
# Words that this project once had in place of the field's: "is told" for "is reported".
PRIVATE_WORDS = (
    r"(?:is|are|be|been) (?:told|said)",
    r"what is",
    r"would do",
    r"so many",
    r"beside",
    r"made least",
    r"the least time",
    r"hindrances?",
    r"what binds",
    r"care of",
    r"the way is gone",
    r"room for",
    r"unsped",
    r"shall pass",
    r"as short as that lets",
    r"does not do",
)
PRIVATE = re.compile(rf"\b(?:{'|'.join(PRIVATE_WORDS)})\b", re.IGNORECASE)


def is_constant_docstring(before: ast.stmt, statement: ast.stmt) -> bool:
    """Whether a statement is a string below an assignment."""
    return (
        isinstance(before, ast.Assign | ast.AnnAssign)
        and isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def lines_of_code(text: str) -> int:
    """Count lines that hold code."""
    described: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        docstrings: list[ast.stmt] = []
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            docstrings.append(node.body[0])
        if isinstance(node, ast.Module | ast.ClassDef):
            docstrings += [b for a, b in pairwise(node.body) if is_constant_docstring(a, b)]
        for docstring in docstrings:
            described.update(range(docstring.lineno, (docstring.end_lineno or 0) + 1))
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in NO_CODE:
            lines.update(range(token.start[0], token.end[0] + 1))
    return len(lines - described)


def script_lines(path: Path) -> int:
    """Count lines of a script that are neither blank nor comments."""
    lines = map(str.strip, path.read_text(encoding="utf-8").splitlines())
    return sum(bool(line) and not line.startswith(("//", "/*", "*")) for line in lines)


def long_functions(path: Path, text: str) -> Iterator[tuple[str, int]]:
    """Functions of more than `LONG_FUNCTION` lines, docstrings included."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            length = (node.end_lineno or node.lineno) - node.lineno + 1
            if length > LONG_FUNCTION:
                yield f"{path.relative_to(ROOT)}:{node.lineno} {node.name}", length


def sources(folder: str) -> dict[Path, str]:
    """Python files below a folder, and their texts."""
    found = sorted((ROOT / folder).rglob("*.py"))
    return {path: path.read_text(encoding="utf-8") for path in found}


@click.command()
def main() -> None:
    """Print the figures of the checkout."""
    console = Console()
    package, tests = sources("src"), sources("tests")
    written = [
        path.read_text(encoding="utf-8")
        for path in (ROOT / "docs").glob("*.md")
        if not path.stem.endswith(RENDERED)
    ]
    rendered = [pages.render(page) for page in pages.PAGES if page.endswith(RENDERED)]
    rooms: dict[str, list[str]] = {}
    for path, text in package.items():
        inner = path.relative_to(ROOT / "src" / "knotwork").parts
        rooms.setdefault(inner[0] if len(inner) > 1 else "(top level)", []).append(text)
    counted = {room: sum(map(lines_of_code, texts)) for room, texts in rooms.items()}
    rows = [[room, str(len(rooms[room])), str(counted[room])] for room in counted]
    rows.sort(key=lambda row: -int(row[2]))
    Table("Package", ("folder", "modules", "lines of code"), rows).show(console)
    lengths = {path: text.count("\n") for path, text in package.items()}
    functions = [one for path, text in package.items() for one in long_functions(path, text)]
    figures = {
        "lines of code in src": sum(counted.values()),
        "modules in src": len(package),
        "lines of code in tests": sum(map(lines_of_code, tests.values())),
        f"modules of more than {LONG_MODULE} lines": sum(n > LONG_MODULE for n in lengths.values()),
        f"functions of more than {LONG_FUNCTION} lines": len(functions),
        "imports inside functions": sum(map(inner_imports, package.values())),
        "names in knotwork": len(knotwork.__all__),
        "private words in src": sum(len(PRIVATE.findall(text)) for text in package.values()),
        "lines of JavaScript": sum(map(script_lines, (ROOT / "src").rglob("*.js"))),
        "words of documentation": sum(len(page.split()) for page in written),
        "words of benchmark pages": sum(len(page.split()) for page in rendered),
    }
    rows = [[name, str(figure)] for name, figure in figures.items()]
    Table("Figures", ("figure", "value"), rows).show(console)
    longest = [(str(p.relative_to(ROOT)), n) for p, n in lengths.items() if n > LONG_MODULE]
    worst = sorted([*longest, *functions], key=lambda one: -one[1])
    rows = [[name, str(length)] for name, length in worst]
    Table("Long modules and functions", ("where", "lines"), rows).show(console)


def inner_imports(text: str) -> int:
    """Count imports inside functions."""
    return sum(
        isinstance(inner, ast.Import | ast.ImportFrom)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef)
        for inner in ast.walk(node)
    )


if __name__ == "__main__":
    main()
