"""Calls in child processes, with time limits. The parent survives their crashes.

The processes of loky, unlike those of `multiprocessing` and Dask, do not import the user's script.
Dask's workers have no time limit for a task, and a crash there ends other tasks, so they have these
children as well. Each child has its own executor, because an executor ends all its processes when
one ends.
"""

from __future__ import annotations

import os
import re
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from typing import Any, TypeVar

from knotwork.errors import InputError, PlanningCrashError, PlanningTimeoutError
from knotwork.verification.checks import changed_checks

MAX_TIME_LIMIT = 1e6
"""Upper bound of time limits [s], required by clocks."""
PARENT_PERIOD = 1.0
"""Interval at which a child process checks that its parent is alive [s]."""
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Each process uses one thread, because NumPy's threads would slow down the other processes."""

Item = TypeVar("Item")
Answer = TypeVar("Answer")


def refuse_changed_checks(instead: str) -> None:
    """Refuse child processes if the user has registered checks, which only this process has.

    Raises:
        InputError: Checks are registered; the message ends with `instead`, the advice.
    """
    if names := changed_checks():
        raise InputError(
            f"child processes do not have your own checks ({', '.join(names)}); {instead}"
        )


class Child:
    """A child process that starts with its first call, and again after it has ended."""

    def __init__(self) -> None:
        self._executor: Any = None

    def call(self, function: Callable[..., Any], *arguments: Any, limit: float) -> Any:
        """Call a function in the child process.

        If the process dies, the call is repeated once, because a system short of memory may have
        ended it.

        Args:
            function: Function of a module.
            arguments: Its arguments.
            limit: Time limit [s].

        Raises:
            PlanningTimeoutError: The call took longer.
            PlanningCrashError: The process ended twice.
        """
        try:
            return self._call_once(function, arguments, limit)
        except PlanningCrashError:
            return self._call_once(function, arguments, limit)

    def _call_once(self, function: Callable[..., Any], arguments: Any, limit: float) -> Any:
        from loky import BrokenProcessPool, ProcessPoolExecutor

        try:
            if self._executor is None:
                self._executor = ProcessPoolExecutor(1, initializer=_begin_child, env=_ONE_THREAD)
                with _interrupts_blocked():
                    started = self._executor.submit(os.getpid)
                started.result()  # the time limit of a call does not include the start
            call = self._executor.submit(function, *arguments)
            wait([call], min(limit, MAX_TIME_LIMIT))
            if call.done():
                return call.result()
        except BrokenProcessPool as error:
            self.close()
            match = re.search(r"exit codes of the workers are {(.*?)}", str(error))
            code = match[1] if match else ""
            message = f"its process ended with {code or 'an unknown code'}"
            raise PlanningCrashError(message, exit_code=code) from error
        self.close()
        raise PlanningTimeoutError(f"took longer than {limit:g} s", time_limit=limit)

    def close(self) -> None:
        """End the process at once."""
        executor, self._executor = self._executor, None
        if executor is not None:
            executor.shutdown(kill_workers=True)


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block keyboard interrupts in this thread, so that a child begins without them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin_child() -> None:
    """Import what planning needs, and end with the parent, which handles keyboard interrupts."""
    import knotwork.planning.sweeps.outcome  # noqa: F401

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, args=[os.getppid()], daemon=True).start()
    with open(os.devnull, "w") as nothing:
        for stream in (1, 2):
            os.dup2(nothing.fileno(), stream)


def _end_with_parent(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(PARENT_PERIOD)
    os._exit(0)


def map_in_children(
    task: Callable[[Child, Item], Answer], items: Iterable[Item], workers: int
) -> Iterator[Answer]:
    """Call a function with each item and one of several child processes, each in a thread.

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

    remaining = iter(items)
    waiting: set[Future[Answer]] = set()
    with ThreadPoolExecutor(workers, initializer=begin) as pool:
        try:
            while True:
                for item in islice(remaining, workers - len(waiting)):
                    waiting.add(pool.submit(perform, item))
                if not waiting:
                    return
                ready, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for future in ready:
                    yield future.result()
        finally:  # inside, because the pool waits for running tasks after an interrupt
            for child in children:
                child.close()
