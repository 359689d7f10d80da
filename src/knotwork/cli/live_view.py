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

    BuildScene: TypeAlias = Callable[[], tuple[dict[str, Any], list[Path], str] | None]

POLL_PERIOD, WRITE_TIME = 0.02, 0.02
"""Polling interval of the files, and the longest time that writing one may take [s]."""

Stamp = tuple[int, int, int] | None


class WatchedFiles:
    """Files and the times of their last changes.

    >>> files = WatchedFiles([Path("task.yaml")])
    >>> files.take_change()
    False
    """

    def __init__(self, paths: Iterable[Path]) -> None:
        self._stamps = {path: _stamp(path) for path in paths}

    def watch(self, paths: Iterable[Path]) -> None:
        """Watch more files, from their present state."""
        for path in paths:
            self._stamps.setdefault(path, _stamp(path))

    def take_change(self) -> bool:
        """Return whether a file was changed since the last call; a missing one counts as unchanged.

        After a change, the call waits until the file is written.
        """
        before = self._stamps
        if all(_stamp(path) in (None, stamp) for path, stamp in before.items()):
            return False
        time.sleep(WRITE_TIME)
        self._stamps = {path: _stamp(path) or stamp for path, stamp in before.items()}
        return True


def _stamp(path: Path) -> Stamp:
    try:
        status = path.stat()
    except OSError:  # an editor may be replacing the file
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


def serve_live(server: LiveServer, files: WatchedFiles, build: BuildScene) -> None:
    """Serve a scene and build it again after each change of a file, until Ctrl-C.

    Args:
        server: Server of the page.
        files: Source files known before the first scene.
        build: Function that returns a scene with its source files and a line to print, or `None` if
            the scene is out of date already.
    """
    serving = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    serving.start()
    try:
        while True:
            _rebuild(server, files, build)
            while not files.take_change():
                time.sleep(POLL_PERIOD)
    finally:
        server.shutdown()


def _rebuild(server: LiveServer, files: WatchedFiles, build: BuildScene) -> None:
    """Build a scene and show it, or the error, with a line on the terminal."""
    start = time.perf_counter()
    server.announce_next()
    try:
        built = build()
    except Exception as error:
        is_input_error = isinstance(error, KnotworkError)
        if not is_input_error and os.environ.get("KNOTWORK_TRACEBACK"):
            raise
        text = str(error) if is_input_error else internal_error(error)
        server.refuse(text)
        echo(f"{time.strftime('%H:%M:%S')} {'error: ' if is_input_error else ''}{text}", err=True)
        return
    if built is None:
        return
    scene, paths, line = built
    files.watch(paths)
    server.show(scene)
    echo(f"{time.strftime('%H:%M:%S')} {line} ({time.perf_counter() - start:.2f} s)")
