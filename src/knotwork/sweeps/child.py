"""A child process that plans: it may hang or crash, and its parent goes on.

Parent and child send each other pickled data through the child's standard input and output. A
child ends with its parent, whose end closes the input, and by itself if a call takes far too long.
"""

from __future__ import annotations

import contextlib
import faulthandler
import importlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from knotwork.errors import InputError

GRACE = 30.0
"""Time after its parent's end at which a child ends itself [s]."""
START_LIMIT = 120.0
"""Time that a child may take until it answers [s]; importing is not the fault of a row."""
END_PATIENCE = 5.0
"""Longest time that a process takes to end after it has closed its pipes [s]."""
LONGEST = 1e8
"""Longer limits are this one [s], as clocks have an end."""
# One process is one thread of work; NumPy's would slow down the others.
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class ChildTimeoutError(Exception):
    """A call took longer than it may."""


class ChildCrashedError(Exception):
    """The child ended during a call; says how."""


def refuse_own_checks(instead: str) -> None:
    """Refuse to plan in child processes where the user has checks, which only this process knows.

    Raises:
        InputError: There are some; `instead` says what to do.
    """
    from knotwork.verification.checks import own_checks

    if own := own_checks():
        raise InputError(
            f"processes that plan do not know your own checks ({', '.join(own)}); {instead}"
        )


_Answer = TypeVar("_Answer")


def again_if_ended(call: Callable[[], _Answer]) -> _Answer:
    """Make a call that a child answers; once more if the child ends, as others may have ended it.

    A system that is short of memory ends processes whose rows are in order.

    Raises:
        ChildTimeoutError: It took longer than it may.
        ChildCrashedError: The child ended both times.
    """
    try:
        return call()
    except ChildCrashedError:
        return call()


class Child:
    """A child process with a `RowPlanner`; started at its first call, and again after its end."""

    def __init__(self) -> None:
        self._process: Any = None
        self._closed = False

    def call(self, method: str, *arguments: Any, limit: float) -> Any:
        """Call a method of the planner.

        Args:
            method: Its name.
            arguments: What it takes.
            limit: Time that it may take [s].

        Raises:
            ChildTimeoutError: It took longer.
            ChildCrashedError: The process came to its end.
        """
        limit = min(limit, LONGEST)
        if self._process is None and not self._closed:
            self._process = _Process()
            self._answer(START_LIMIT)
        if self._closed:
            raise ChildCrashedError("it was closed")
        return self._answer(limit, (method, arguments, limit))

    def _answer(self, limit: float, question: Any = None) -> Any:
        """What the child says next, if it is in time."""
        process, late = self._process, threading.Event()

        def stop() -> None:
            late.set()
            process.popen.kill()

        timer = threading.Timer(limit, stop)
        timer.daemon = True
        timer.start()
        try:
            if question is not None:
                pickle.dump(question, process.sink)
                process.sink.flush()
            ok, answer = pickle.load(process.source)
        except (EOFError, OSError, pickle.UnpicklingError) as error:
            code = self._ended(END_PATIENCE)
            if late.is_set():
                raise ChildTimeoutError(f"took longer than {limit:g} s") from error
            raise ChildCrashedError(_exit_reason(code)) from error
        finally:
            timer.cancel()
        timer.join()
        if late.is_set():  # the answer came just before
            self._ended()
        if not ok:
            raise answer
        return answer

    def _ended(self, patience: float = 0.0) -> int:
        """Have the process gone; its exit code."""
        process, self._process = self._process, None
        return 0 if process is None else process.end(patience)

    def close(self) -> None:
        """End the process, whatever it is about, and start none again."""
        self._closed = True
        self._ended()


class _Process:
    """The process and both ends of its pipes."""

    def __init__(self) -> None:
        self.popen = subprocess.Popen(
            [sys.executable, "-m", "knotwork.sweeps.child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **dict.fromkeys(_ONE_THREAD, "1")},
        )
        self.sink: Any = self.popen.stdin
        self.source: Any = self.popen.stdout

    def end(self, patience: float) -> int:
        """Have the process gone, if need be by force; its exit code."""
        try:
            code = self.popen.wait(patience)
        except subprocess.TimeoutExpired:
            self.popen.kill()
            code = self.popen.wait()
        for pipe in (self.sink, self.source):
            with contextlib.suppress(OSError):
                pipe.close()
        return code


def _exit_reason(code: int) -> str:
    """How a process ended, in words."""
    if code >= 0:
        return f"the process that planned it ended with code {code}"
    with contextlib.suppress(ValueError):
        return f"the process that planned it was ended by {signal.Signals(-code).name}"
    return f"the process that planned it was ended by signal {-code}"


def main() -> None:
    """Answer calls until there are no more."""
    from knotwork.sweeps.row_planner import RowPlanner

    importlib.import_module("knotwork.sweeps.outcome")  # before the first row's time runs
    # Whatever else writes to standard output must not come between the answers.
    source, sink = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    # An interrupt from the keyboard goes to the parent, which ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    planner = RowPlanner()
    _send(sink, (True, None))
    for method, arguments, limit in _calls(source):
        faulthandler.dump_traceback_later(limit + GRACE, exit=True, file=nothing)
        try:
            answer = True, getattr(planner, method)(*arguments)
        except Exception as error:
            answer = False, error
        _send(sink, answer)
        faulthandler.cancel_dump_traceback_later()


def _send(sink: Any, answer: tuple[bool, Any]) -> None:
    pickle.dump(answer, sink)
    sink.flush()


def _calls(source: Any) -> Iterator[tuple[str, tuple[Any, ...], float]]:
    """Calls of the parent; when that has gone this process ends, whatever it is about."""
    asked: queue.SimpleQueue[tuple[str, tuple[Any, ...], float]] = queue.SimpleQueue()

    def listen() -> None:
        code = 1
        try:
            while True:
                asked.put(pickle.load(source))
        except EOFError:
            code = 0
        finally:
            os._exit(code)

    threading.Thread(target=listen, daemon=True).start()
    while True:
        yield asked.get()


if __name__ == "__main__":
    main()
