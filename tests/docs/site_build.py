"""Building the documentation, strictly: warnings fail."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Site:
    """A build of the documentation: where it is, how it ended, and what it said."""

    folder: Path
    code: int
    said: str

    def page(self, name: str) -> str:
        return (self.folder / f"{name}.html").read_text(encoding="utf-8")

    @property
    def pages(self) -> list[Path]:
        return sorted(p for p in self.folder.rglob("*.html") if "_static" not in p.parts)


def build(source: Path, folder: Path, *options: str) -> Site:
    command = [sys.executable, "-m", "sphinx", "-W", "-n", "--keep-going", "-E", "-q"]
    done = subprocess.run(
        [*command, *options, "-d", f"{folder}-trees", str(source), str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return Site(folder, done.returncode, done.stdout)
