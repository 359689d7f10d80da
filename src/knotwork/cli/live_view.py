"""`knotwork view --watch`, `knotwork edit`: a page that follows its files, until Ctrl-C."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from knotwork.cli.terminal import echo, internal_error
from knotwork.errors import KnotworkError

if TYPE_CHECKING:
    from knotwork.view.live_server import LiveServer

    Made: TypeAlias = Callable[[], tuple[dict[str, Any], list[Path], str] | None]

# Polling interval of the files, and the longest time that writing one may take [s].
PERIOD, REST = 0.02, 0.02

Stamp = tuple[int, int, int] | None


class Files:
    """Files and the times of their last changes.

    >>> files = Files([Path("task.yaml")])
    >>> files.changed()
    False
    """

    def __init__(self, paths: Iterable[Path]) -> None:
        self._stamps = {path: _stamp(path) for path in paths}

    def follow(self, paths: Iterable[Path]) -> None:
        """Follow more files, from their present state."""
        for path in paths:
            self._stamps.setdefault(path, _stamp(path))

    def changed(self) -> bool:
        """Whether a file was changed since the last call; a missing file counts as unchanged.

        If so, it waits until the file is written.
        """
        before = self._stamps
        if all(_stamp(path) in (None, stamp) for path, stamp in before.items()):
            return False
        time.sleep(REST)
        self._stamps = {path: _stamp(path) or stamp for path, stamp in before.items()}
        return True


def _stamp(path: Path) -> Stamp:
    try:
        status = path.stat()
    except OSError:  # an editor may be replacing the file
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


def follow(server: LiveServer, files: Files, make: Made) -> None:
    """Serve a scene and rebuild it after each change of a file, until Ctrl-C.

    Args:
        server: Server of the page.
        files: Source files known before the first scene.
        make: Builds the scene; returns it with its source files and a line to print, or `None` to
            build another one at once.
    """
    serving = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    serving.start()
    try:
        while True:
            _renew(server, files, make)
            while not files.changed():
                time.sleep(PERIOD)
    finally:
        server.shutdown()


def _renew(server: LiveServer, files: Files, make: Made) -> None:
    start = time.perf_counter()
    server.start()
    try:
        renewed = make()
    except Exception as error:
        is_input_error = isinstance(error, KnotworkError)
        if not is_input_error and os.environ.get("KNOTWORK_TRACEBACK"):
            raise
        text = str(error) if is_input_error else internal_error(error)
        server.refuse(text)
        echo(f"{time.strftime('%H:%M:%S')} {'error: ' if is_input_error else ''}{text}", err=True)
        return
    if renewed is None:
        return
    scene, paths, line = renewed
    files.follow(paths)
    server.show(scene)
    echo(f"{time.strftime('%H:%M:%S')} {line} ({time.perf_counter() - start:.2f} s)")
