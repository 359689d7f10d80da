"""Child processes that plan: one may hang or crash, and its parent goes on.

Parent and child send each other pickled data through the child's standard input and output. A
child ends with its parent, whose end closes the input, and by itself if a call takes too long.
"""

from __future__ import annotations

import contextlib
import faulthandler
import importlib
import math
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from typing import Any, TypeVar

from knotwork.errors import InputError

START_LIMIT = 120.0
"""Time that a child may take to import what it needs [s], which is not the fault of a row."""
END_PATIENCE = 5.0
"""Longest time that a process takes to end after it has closed its pipes [s]."""
LONGEST = 1e8
"""Longer limits are this one [s], as clocks have an end."""
POLL = 1.0
"""Longest time between two looks at how many tasks may be under way [s]."""
# One process is one thread of work; NumPy's would slow down the others.
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

_Question = tuple[Callable[..., Any], tuple[Any, ...], float]
"""A function, its arguments, and the time that it may take [s]."""
Item = TypeVar("Item")
Answer = TypeVar("Answer")


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


class Child:
    """A child process; started at its first call, and again after its end."""

    def __init__(self) -> None:
        self._process: Any = None
        self._closed = False

    def call(self, function: Callable[..., Any], *arguments: Any, limit: float) -> Any:
        """Call a function there; once more if the child ends, as others may have ended it.

        A system that is short of memory ends processes whose rows are in order.

        Args:
            function: One of a module.
            arguments: What it takes.
            limit: Time that it may take [s].

        Raises:
            ChildTimeoutError: It took longer.
            ChildCrashedError: The process ended both times, or this was closed.
        """
        question = function, arguments, min(limit, LONGEST)
        try:
            return self._asked(question)
        except ChildCrashedError:
            return self._asked(question)

    def _asked(self, question: _Question) -> Any:
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
            self._answer(None, math.inf)
        return self._answer(question, question[-1])

    def _answer(self, question: Any, limit: float) -> Any:
        """What the child says next; it ends itself if that takes longer than the limit."""
        process, begin = self._process, time.monotonic()
        try:
            if question is not None:
                pickle.dump(question, process.stdin)
                process.stdin.flush()
            ok, answer = pickle.load(process.stdout)
        except (EOFError, OSError, ValueError, pickle.UnpicklingError) as error:
            took = time.monotonic() - begin
            self._process = None
            code = _ended(process, END_PATIENCE)
            if took >= limit:
                raise ChildTimeoutError(f"took longer than {limit:g} s") from error
            raise ChildCrashedError(_exit_reason(code)) from error
        if not ok:
            raise answer
        return answer

    def close(self) -> None:
        """End the process, whatever it is about, and start none again."""
        self._closed = True
        process, self._process = self._process, None
        if process is not None:
            _ended(process, 0.0)


def _ended(process: subprocess.Popen[bytes], patience: float) -> int:
    """Have a process gone, after some time by force; its exit code."""
    try:
        code = process.wait(patience)
    except subprocess.TimeoutExpired:
        process.kill()
        code = process.wait()
    for pipe in (process.stdin, process.stdout):
        with contextlib.suppress(OSError):
            if pipe is not None:
                pipe.close()
    return code


def _exit_reason(code: int) -> str:
    """How a process ended, in words."""
    if code >= 0:
        return f"the process that planned it ended with code {code}"
    with contextlib.suppress(ValueError):
        return f"the process that planned it was ended by {signal.Signals(-code).name}"
    return f"the process that planned it was ended by signal {-code}"


def by_children(
    task: Callable[[Child, Item], Answer], items: Iterable[Item], workers: int
) -> Iterator[Answer]:
    """Perform a task for each item with one of some child processes, each in a thread.

    Yields:
        What the tasks return, in the order in which they are ready.
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
        finally:  # inside, as the pool waits for what is under way when an interrupt ends this
            for child in children:
                child.close()


def as_ready(
    submit: Callable[[Item], Future[Answer]], items: Iterable[Item], most: Callable[[], int]
) -> Iterator[Answer]:
    """Submit items, with at most `most()` under way; give answers as they are ready."""
    left, waiting = iter(items), set[Future[Answer]]()
    while True:
        waiting.update(map(submit, islice(left, max(0, most() - len(waiting)))))
        if not waiting:
            return
        ready, waiting = wait(waiting, timeout=POLL, return_when=FIRST_COMPLETED)
        for one in ready:
            yield one.result()


def main() -> None:
    """Answer calls until there are no more."""
    # Whatever else writes to standard output must not come between the answers.
    source, sink = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    # An interrupt from the keyboard goes to the parent, which ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    faulthandler.dump_traceback_later(START_LIMIT, exit=True, file=nothing)
    importlib.import_module("knotwork.sweeps.outcome")
    _send(sink, (True, None))
    for function, arguments, limit in _calls(source):
        # a thread without Python, which nothing that a row does can hold up
        faulthandler.dump_traceback_later(limit, exit=True, file=nothing)
        try:
            answer = True, function(*arguments)
        except Exception as error:
            answer = False, error
        _send(sink, answer)


def _send(sink: Any, answer: tuple[bool, Any]) -> None:
    faulthandler.cancel_dump_traceback_later()
    pickle.dump(answer, sink)
    sink.flush()


def _calls(source: Any) -> Iterator[_Question]:
    """Calls of the parent; when that has gone this process ends, whatever it is about."""
    asked: queue.SimpleQueue[_Question] = queue.SimpleQueue()

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
