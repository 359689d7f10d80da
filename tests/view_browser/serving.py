"""A command that serves pages until it is interrupted, as a process of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from patience import PATIENCE

READY = "html[data-ready=true]"
"""A selector of pages whose scene is drawn."""
NEXT_FRAME = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
"""Of a page: a frame is drawn of what it is now."""
KNOTWORK = ("-m", "knotwork")
needs_signals = pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent as a signal")


class Serving:
    """A serving command: its address, and after its end what it printed."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process, self.out, self.err = process, "", ""
        self.address = process.stdout.readline().split(" at ")[1].split()[0]

    def stop(self) -> None:
        """End the command, once."""
        if not self.out:
            self.process.send_signal(signal.SIGINT)
            self.out, self.err = self.process.communicate(timeout=PATIENCE)
            assert self.process.returncode == 0, self.err
            assert "stopped" in self.out


@contextmanager
def serve(
    *arguments: str | Path,
    program: tuple[str, ...] = KNOTWORK,
    folder: Path | None = None,
    environment: Mapping[str, str] | None = None,
) -> Iterator[Serving]:
    """Run a command that serves a page; it is stopped at the end."""
    with subprocess.Popen(
        [sys.executable, "-u", *program, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        env=dict(os.environ if environment is None else environment),
    ) as process:
        serving = Serving(process)
        try:
            yield serving
        finally:
            serving.stop()
