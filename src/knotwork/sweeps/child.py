"""Child processes for planning; a parent survives their crashes and timeouts.

Parent and child have a pipe. A child ends when its parent does, which closes it. The pools of
`concurrent.futures` and `multiprocessing` are not sufficient: they give up all processes when one
ends, have no time limits, or import the user's script.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from knotwork.errors import InputError
from knotwork.verification.checks import own_checks

START_LIMIT = 120.0
"""Time for imports in a child [s], not counted for a row."""
LONGEST_LIMIT = 1e6
"""Upper bound of time limits [s], required by clocks."""
POLL_PERIOD = 1.0
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
    if names := own_checks():
        raise InputError(
            f"child processes do not have your own checks ({', '.join(names)}); {instead}"
        )


class Child:
    """A child process; started at its first call, and restarted after its end."""

    def __init__(self) -> None:
        self._process: Any = None
        self._pipe: Any = None
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
            return self._ask((function, arguments), limit)
        except ChildCrashedError:
            return self._ask((function, arguments), limit)

    def _ask(self, question: Any, limit: float) -> Any:
        if self._closed:
            raise ChildCrashedError("it was closed")
        if self._process is None:
            self._pipe, far_end = Pipe()
            with far_end:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "knotwork.sweeps.child", str(far_end.fileno())],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    pass_fds=[far_end.fileno()],
                    env={**os.environ, **dict.fromkeys(_ONE_THREAD, "1")},
                )
            try:
                self._answer((_load, ()), START_LIMIT)
            except ChildTimeoutError as error:
                raise ChildCrashedError(f"the child process {error} to start") from error
        return self._answer(question, limit)

    def _answer(self, question: Any, limit: float) -> Any:
        """The child's answer; the child is ended after the time limit."""
        process = self._process
        try:
            self._pipe.send(question)
            answer = self._pipe.recv() if self._pipe.poll(min(limit, LONGEST_LIMIT)) else None
        except (EOFError, OSError) as error:
            raise ChildCrashedError(_exit_reason(self._end(process))) from error
        if answer is None:
            self._end(process)
            raise ChildTimeoutError(f"took longer than {limit:g} s")
        ok, result = answer
        if not ok:
            raise result
        return result

    def _end(self, process: Any) -> int:
        """End the process, which may have ended already, and give its exit code."""
        self._process = None
        process.kill()
        code: int = process.wait()
        self._pipe.close()
        return code

    def close(self) -> None:
        """End the process at once, and start none again."""
        self._closed = True
        process, self._process = self._process, None
        if process is not None:  # the thread that waits for an answer closes the pipe
            process.kill()
            process.wait()


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
    children: list[Child] = []
    thread = threading.local()

    def begin() -> None:
        thread.child = Child()
        children.append(thread.child)

    def perform(item: Item) -> Answer:
        return task(thread.child, item)

    with ThreadPoolExecutor(workers, initializer=begin) as pool:
        try:
            yield from as_ready(lambda item: pool.submit(perform, item), items, lambda: workers)
        finally:  # inside, as the pool waits for running tasks after an interrupt
            for child in children:
                child.close()


def as_ready(
    submit: Callable[[Item], Future[Answer]], items: Iterable[Item], most: Callable[[], int]
) -> Iterator[Answer]:
    """Submit items, at most `most()` at a time, and give answers in the order of completion."""
    remaining, waiting = iter(items), set[Future[Answer]]()
    while True:
        waiting.update(map(submit, islice(remaining, max(0, most() - len(waiting)))))
        if not waiting:
            return
        ready, waiting = wait(waiting, timeout=POLL_PERIOD, return_when=FIRST_COMPLETED)
        for future in ready:
            yield future.result()


def _load() -> None:
    """Import the modules for planning."""
    importlib.import_module("knotwork.sweeps.outcome")


def main() -> None:
    """Answer calls until the parent closes the pipe."""
    pipe: Any = Connection(int(sys.argv[1]))
    # The parent handles keyboard interrupts, and ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    questions: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def receive_questions() -> None:
        """End this process when the parent has gone."""
        try:
            while True:
                questions.put(pipe.recv())
        finally:
            os._exit(0)

    threading.Thread(target=receive_questions, daemon=True).start()
    while True:
        function, arguments = questions.get()
        try:
            answer = True, function(*arguments)
        except Exception as error:
            answer = False, error
        pipe.send(answer)


if __name__ == "__main__":
    main()
