"""Directives that run what a page shows, while the page is built: what it says is what happened.

`file` shows a file and writes it, `run` runs commands and shows what they print, `python` runs code
and shows what it prints or the error that it ends with. All blocks of a page share a folder and
Python's names. What does not end as said is a warning, with which the build fails.
"""

from __future__ import annotations

import contextlib
import io
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.parsers.rst import directives
from drawings import drawing
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

MOST_SENTENCES = 12
ROOT = Path(__file__).parents[2]  # of the repository, where examples are


class _Page:
    """The folder and the names that the blocks of one page share."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="knotwork-docs-"))
        self.names: dict[str, Any] = {"__name__": "__page__"}


class Shown(SphinxDirective):
    """What the directives have in common."""

    has_content = True

    @property
    def page(self) -> _Page:
        """Folder and names of the page that is being read."""
        pages: dict[str, _Page] = self.env.app.shown_pages  # type: ignore[attr-defined]
        if self.env.docname not in pages:
            pages[self.env.docname] = _Page()
        return pages[self.env.docname]

    @contextlib.contextmanager
    def there(self) -> Iterator[io.StringIO]:
        """Work in the page's folder, and catch what is printed."""
        before, printed = Path.cwd(), io.StringIO()
        os.chdir(self.page.folder)
        try:
            with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
                yield printed
        finally:
            os.chdir(before)

    def fault(self, message: str) -> None:
        """Complain; the build goes on and fails in the end."""
        self.env.app.statuscode = 1
        from sphinx.util import logging

        logging.getLogger(__name__).warning(message, location=self.get_location())

    def block(self, text: str, language: str, kind: str) -> nodes.Node:
        """Code or output."""
        block = nodes.literal_block(text, text, language=language, classes=[kind])
        self.set_source_info(block)
        return block


def output(block: Any) -> nodes.Node:
    """Have sentences broken into lines; tables and long files scroll instead."""
    lines = block.astext().split("\n")
    if len(lines) <= MOST_SENTENCES and not any("──" in line for line in lines):
        block["classes"].append("sentences")
    return block  # type: ignore[no-any-return]


class File(Shown):
    """`file NAME`: show a file and write it; `of` names a page whose first YAML block it is."""

    option_spec = {"of": directives.unchanged}  # noqa: RUF012
    required_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        """Write it, show it under its name."""
        name, text = self.arguments[0], "\n".join(self.content) + "\n"
        if "of" in self.options:
            page = Path(self.env.srcdir, self.options["of"]).resolve()
            self.env.note_dependency(str(page))
            text = page.read_text(encoding="utf-8").partition("```yaml\n")[2].partition("```")[0]
        path = self.page.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        kinds = {".yaml": "yaml", ".py": "python", ".csv": "text", ".urdf": "xml", ".obj": "text"}
        block = self.block(text, kinds[path.suffix], "file")
        caption = nodes.caption("", "", nodes.literal(name, name))
        return [nodes.container("", caption, block, literal_block=True, classes=["file-shown"])]


class Run(Shown):
    """`run`: run commands, show them and what they print.

    Options: `exit`, the exit code of the last (0); `first` and `last`, how many lines of the
    output to show from its start and its end, otherwise all of it; `quiet`, none.
    """

    option_spec = {  # noqa: RUF012
        "exit": directives.nonnegative_int,
        "first": directives.nonnegative_int,
        "last": directives.nonnegative_int,
        "quiet": directives.flag,
    }

    def run(self) -> list[nodes.Node]:
        """Run them one after the other."""
        commands = [line for line in self.content if line.strip()]
        shown = self.block("\n".join(f"$ {c}" for c in commands), "console", "command")
        text, code = "", 0
        for i, command in enumerate(commands):
            printed, code = self.command(command)
            text += printed
            if i < len(commands) - 1 and code != 0:
                self.fault(f"{command!r} ended with exit code {code}:\n{printed}")
        if code != self.options.get("exit", 0):
            self.fault(f"{commands[-1]!r} ended with exit code {code}:\n{text}")
        text = self.part(text)
        if "quiet" in self.options or not text.strip():
            return [shown]
        return [shown, output(self.block(text, "text", "output"))]

    def command(self, line: str) -> tuple[str, int]:
        """What a command prints, and its exit code; Knotwork's own run in this process."""
        words = shlex.split(line)
        if words[0] != "knotwork":
            words = [str(ROOT / w) if w.startswith("examples/") else w for w in words]
            python = {"pytest": [sys.executable, "-m", "pytest"], "python": [sys.executable]}
            program = [*python.get(words[0], words[:1]), *words[1:]]
            done = subprocess.run(
                program,
                cwd=self.page.folder,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                encoding="utf-8",
                env={**os.environ, "PYTHONIOENCODING": "utf-8"},
                check=False,
            )
            return done.stdout, done.returncode
        from knotwork.cli.main import main

        given, code = sys.argv, 0
        sys.argv = words
        try:
            with self.there() as printed:
                main()
        except SystemExit as end:
            code = int(end.code or 0)
        finally:
            sys.argv = given
        return printed.getvalue(), code

    def part(self, text: str) -> str:
        """The lines that are wanted."""
        lines = [line.rstrip() for line in text.rstrip("\n").split("\n")]
        first, last = self.options.get("first", 0), self.options.get("last", 0)
        if not (first or last) or first + last >= len(lines):
            return "\n".join(lines)
        return "\n".join([*lines[:first], "…", *(lines[-last:] if last else [])])


class Python(Shown):
    """`python`: run code, show it and what it prints.

    Options: `raises`, the name of the error that it must end with; `hidden`, do not show it.
    """

    option_spec = {"raises": directives.unchanged, "hidden": directives.flag}  # noqa: RUF012

    def run(self) -> list[nodes.Node]:
        """Run it with the names of the page."""
        source = "\n".join(self.content)
        wanted, ended = self.options.get("raises"), None
        with self.there() as printed:
            try:
                exec(compile(source, f"<{self.env.docname}>", "exec"), self.page.names)
            except Exception as error:
                ended = type(error).__name__
                print(f"{ended}: {error}")  # noqa: T201
        text = printed.getvalue().rstrip("\n")
        if ended != wanted:
            self.fault(f"code ended with {ended}, not {wanted}:\n{source}\n{text}")
        if "hidden" in self.options:
            return []
        shown = self.block(source, "python", "code")
        return [shown, output(self.block(text, "text", "output"))] if text else [shown]


class Picture(Shown):
    """`picture FILE`: show a picture that a block before it has made; the content describes it."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Take the file to where Sphinx collects pictures."""
        made = self.page.folder / self.arguments[0]
        if not made.is_file():
            self.fault(f"no block before this one has made {made.name}")
            return []
        folder = Path(self.env.doctreedir) / "pictures"
        folder.mkdir(exist_ok=True)
        if made.suffix == ".svg":
            return [drawing(made, " ".join(self.content))]
        name = f"{self.env.docname.replace('/', '-')}-{made.name}"
        shutil.copyfile(made, folder / name)
        uri = os.path.relpath(folder / name, self.env.srcdir)
        image = nodes.image(uri=f"/{uri}", alt=" ".join(self.content))
        image["classes"] = ["drawn"]
        return [image]


def _start(app: Sphinx) -> None:
    app.shown_pages = {}  # type: ignore[attr-defined]


def _end(app: Sphinx, _error: Any) -> None:
    for page in app.shown_pages.values():  # type: ignore[attr-defined]
        shutil.rmtree(page.folder, ignore_errors=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directives."""
    app.connect("builder-inited", _start)
    app.connect("build-finished", _end)
    app.add_directive("file", File)
    app.add_directive("run", Run)
    app.add_directive("python", Python)
    app.add_directive("picture", Picture)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
