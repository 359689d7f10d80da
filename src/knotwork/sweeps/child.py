"""Child processes for planning; a parent survives their crashes and timeouts.

Parent and child exchange pickled data through the child's standard input and output. A
child ends when its parent does, which closes the input. `concurrent.futures` is not sufficient:
it gives up all processes when one ends, has no time limits, and imports the user's script.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from typing import Any, TypeVar

from knotwork.errors import InputError
from knotwork.verification.checks import own_checks

START_LIMIT = 120.0
"""Time for imports in a child [s], not counted for a row."""
LONGEST = 1e8
"""Upper bound of time limits [s], required by clocks."""
POLL = 1.0
"""Longest interval between checks of the number of tasks in progress [s]."""
# One process is one thread of work; NumPy's threads would slow down the others.
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

Item = TypeVar("Item")
Answer = TypeVar("Answer")


class ChildTimeoutError(Exception):
    """A call took longer than its limit."""


class ChildCrashedError(Exception):
    """The child ended during a call; the message has the reason."""


def refuse_own_checks(instead: str) -> None:
    """Refuse child processes if the user has registered checks, which only this process has.

    Raises:
        InputError: Checks are registered; `instead` is the advice.
    """
    if own := own_checks():
        raise InputError(
            f"child processes do not have your own checks ({', '.join(own)}); {instead}"
        )


class Child:
    """A child process; started at its first call, and restarted after its end."""

    def __init__(self) -> None:
        self._process: Any = None
        self._closed = False

    def call(self, function: Callable[..., Any], *arguments: Any, limit: float) -> Any:
        """Call a function in the child, a second time if it ends, as others may have ended it.

        A system short of memory ends processes whose rows are valid.

        Args:
            function: Function of a module.
            arguments: Its arguments.
            limit: Time limit [s].

        Raises:
            ChildTimeoutError: The call took longer.
            ChildCrashedError: The process ended twice, or this object was closed.
        """
        try:
            return self._asked((function, arguments), limit)
        except ChildCrashedError:
            return self._asked((function, arguments), limit)

    def _asked(self, question: Any, limit: float) -> Any:
        if self._closed:
            raise ChildCrashedError("it was closed")
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "knotwork.sweeps.child"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**os.environ, **dict.fromkeys(_ONE_THREAD, "1")},
            )
            try:
                self._answer((_load, ()), START_LIMIT)
            except ChildTimeoutError as error:
                raise ChildCrashedError(f"the child process {error} to start") from error
        return self._answer(question, limit)

    def _answer(self, question: Any, limit: float) -> Any:
        """The child's answer; the child is ended after the time limit."""
        process, late = self._process, threading.Event()

        def end() -> None:
            late.set()
            process.kill()

        timer = threading.Timer(min(limit, LONGEST), end)
        timer.start()
        try:
            pickle.dump(question, process.stdin)
            process.stdin.flush()
            ok, answer = pickle.load(process.stdout)
        except (EOFError, OSError, ValueError, pickle.UnpicklingError) as error:
            self._process = None
            _end(process)
            if late.is_set():
                raise ChildTimeoutError(f"took longer than {limit:g} s") from error
            raise ChildCrashedError(_exit_reason(process.returncode)) from error
        finally:
            timer.cancel()
        if not ok:
            raise answer
        return answer

    def close(self) -> None:
        """End the process at once, and start none again."""
        self._closed = True
        process, self._process = self._process, None
        if process is not None:
            _end(process)


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process that may have ended already, and close its pipes."""
    process.kill()
    with contextlib.suppress(OSError), process:
        pass


def _exit_reason(code: int) -> str:
    """Reason of a process's end, in words."""
    if code >= 0:
        return f"its process ended with code {code}"
    with contextlib.suppress(ValueError):
        return f"its process was ended by {signal.Signals(-code).name}"
    return f"its process was ended by signal {-code}"


def by_children(
    task: Callable[[Child, Item], Answer], items: Iterable[Item], workers: int
) -> Iterator[Answer]:
    """Perform a task for each item with one of some child processes, each in a thread.

    Yields:
        Results of the tasks, in the order of completion.
    """
    children = [Child() for _ in range(workers)]
    free: queue.SimpleQueue[Child] = queue.SimpleQueue()
    for child in children:
        free.put(child)

    def performed(item: Item) -> Answer:
        child = free.get()
        try:
            return task(child, item)
        finally:
            free.put(child)

    with ThreadPoolExecutor(workers) as pool:
        try:
            yield from as_ready(lambda item: pool.submit(performed, item), items, lambda: workers)
        finally:  # inside, as the pool waits for running tasks after an interrupt
            for child in children:
                child.close()


def as_ready(
    submit: Callable[[Item], Future[Answer]], items: Iterable[Item], most: Callable[[], int]
) -> Iterator[Answer]:
    """Submit items, at most `most()` at a time, and give answers in the order of completion."""
    left, waiting = iter(items), set[Future[Answer]]()
    while True:
        waiting.update(map(submit, islice(left, max(0, most() - len(waiting)))))
        if not waiting:
            return
        ready, waiting = wait(waiting, timeout=POLL, return_when=FIRST_COMPLETED)
        for one in ready:
            yield one.result()


def _load() -> None:
    """Import the modules for planning."""
    importlib.import_module("knotwork.sweeps.outcome")


def main() -> None:
    """Answer calls until the input ends."""
    # Other output must not mix with the answers.
    source, sink = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    # The parent handles keyboard interrupts, and ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    asked: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def listen() -> None:
        """End this process when the parent has gone."""
        try:
            while True:
                asked.put(pickle.load(source))
        finally:
            os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    while True:
        function, arguments = asked.get()
        try:
            answer = True, function(*arguments)
        except Exception as error:
            answer = False, error
        pickle.dump(answer, sink)
        sink.flush()


if __name__ == "__main__":
    main()
