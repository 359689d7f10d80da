"""Building the documentation, strictly: warnings fail."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from command_line import python


@dataclass(frozen=True)
class Site:
    """A build of the documentation: where it is, how it ended, and what it printed."""

    folder: Path
    code: int
    output: str

    def page(self, name: str) -> str:
        return (self.folder / f"{name}.html").read_text(encoding="utf-8")

    @property
    def pages(self) -> list[Path]:
        return sorted(p for p in self.folder.rglob("*.html") if "_static" not in p.parts)


def build(source: Path, folder: Path, *options: str) -> Site:
    strictly = ("-m", "sphinx", "-W", "-n", "--keep-going", "-E", "-q")
    together: dict[str, Any] = {
        "capture_output": False,
        "stdout": subprocess.PIPE,
        "stderr": subprocess.STDOUT,
    }
    together["timeout"] = None  # a page runs what it shows
    done = python(*strictly, *options, "-d", f"{folder}-trees", source, folder, **together)
    return Site(folder, done.returncode, done.stdout)
