"""Where chunks are planned: in this process, in a child of it, or by the workers of Dask."""

from __future__ import annotations

import asyncio
import contextlib
import math
import secrets
import signal
import tempfile
import threading
import time
from collections.abc import Iterator
from itertools import islice
from typing import Any

from knotwork.errors import InputError
from knotwork.sweeps.packages import dask_config, distributed, own_version
from knotwork.sweeps.work import (
    ChildWorker,
    Chunk,
    FinishedChunk,
    HereWorker,
    perform,
    perform_in_child,
)

AHEAD = 3
"""Chunks that are handed over for each worker: one is planned, the next ones wait for it."""
RECOUNT = 5.0
"""Time until the workers are counted again [s]."""
QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "5s",
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.admin.tick.interval": "1s",
}
"""Dask's workers watch themselves closely, which takes a twentieth of a processor."""
SILENT = 50
"""Level of logging that keeps Dask from writing of workers that are lost; they are replaced."""
CONNECT_TIMEOUT = 20.0
"""To a scheduler [s]."""
LONGEST_ABSENCE = 300.0
"""Longest time that chunks wait for a worker [s]."""
LONGEST_ANSWER = LONGEST_FETCH = 60.0
"""Longest time for an answer of the scheduler, and for a finished chunk to arrive [s]."""
GLANCE = 0.02
"""Time between polls for finished chunks [s]."""
PLANNED_AGAIN = ("lost", "pending")
"""What Dask says of a result that was lost with its worker before it was fetched."""
LOST = "the connection to the scheduler was lost"
KEPT = "what is finished is kept, go on with --resume"


def here(chunks: Iterator[Chunk]) -> Iterator[FinishedChunk]:
    """Plan chunks in this process, one after the other; a crash ends it."""
    worker = HereWorker()
    for chunk in chunks:
        yield perform(chunk, worker)


def in_one_child(chunks: Iterator[Chunk]) -> Iterator[FinishedChunk]:
    """Plan chunks in a child process, one after the other."""
    worker = ChildWorker()
    try:
        for chunk in chunks:
            yield perform(chunk, worker)
    finally:
        worker.close()


def on_local_cluster(chunks: Iterator[Chunk], workers: int) -> Iterator[FinishedChunk]:
    """Plan chunks on a Dask cluster of this machine, in the order in which they are ready."""
    dask = distributed()
    with contextlib.ExitStack() as stack:
        stack.enter_context(dask_config().set(QUIET))
        try:
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="knotwork-"))
            with _interrupts_for_this_process():
                cluster = dask.LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=":0",
                    memory_limit=0,
                    local_directory=folder,
                    silence_logs=SILENT,
                    preload=[__name__],
                )
        except (RuntimeError, OSError) as error:  # for example a worker was ended from outside
            raise InputError(
                f"the {workers} worker processes could not be started ({error}); a script that "
                'starts some must have `if __name__ == "__main__":`'
            ) from error
        stack.enter_context(cluster)
        yield from _by(stack.enter_context(dask.Client(cluster)), chunks)


def dask_setup(_worker: Any) -> None:
    """Called by Dask in a worker: one that replaces a lost one, too, ignores an interrupt."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextlib.contextmanager
def _interrupts_for_this_process() -> Iterator[None]:
    """Have processes that are started meanwhile ignore an interrupt from the keyboard.

    This one ends them, and what each of them would say of it is of no use.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def on_scheduler(chunks: Iterator[Chunk], address: str) -> Iterator[FinishedChunk]:
    """Plan chunks on the workers of a scheduler, in the order in which they are ready.

    Raises:
        InputError: There is no scheduler at the address, or its workers can't plan for it.
    """
    with _client(address) as client:
        _check_workers(client, address)
        yield from _by(client, chunks)


def thread_count(address: str) -> int:
    """How many chunks the workers of a scheduler can plan at once.

    Raises:
        InputError: There is no scheduler at the address.
    """
    with _client(address) as client, _connected():
        return sum(client.nthreads(callback_timeout=LONGEST_ANSWER).values())


def _client(address: str) -> Any:
    try:
        return distributed().Client(address, timeout=CONNECT_TIMEOUT)
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(
            f"scheduler {address}: can't be reached ({error or type(error).__name__}); accepted: "
            "the address that dask scheduler prints, for example tcp://host:8786"
        ) from error


def _check_workers(client: Any, address: str) -> None:
    try:
        versions = client.run(own_version)
    except Exception as error:
        raise InputError(
            f"scheduler {address}: its workers can't plan: {error}; install knotwork[sweep] there"
        ) from error
    if not versions:
        raise InputError(f"scheduler {address}: has no workers; start some with dask worker")
    for worker, version in versions.items():
        if version != own_version():
            raise InputError(
                f"scheduler {address}: worker {worker} has knotwork {version}, and here it is "
                f"{own_version()}; install the same version"
            )


def _by(client: Any, chunks: Iterator[Chunk]) -> Iterator[FinishedChunk]:
    """Hand chunks over as earlier ones become ready, so that few are under way at any time.

    Raises:
        InputError: The scheduler or all workers are lost, or a chunk ended the workers it was given
            to.
    """
    waiting, crew, under_way = distributed().as_completed(raise_errors=False), _Crew(client), 0
    while True:
        for chunk in islice(chunks, max(0, AHEAD * crew.count() - under_way)):
            key = f"knotwork-{secrets.token_hex(4)}-{chunk.index}"
            with _connected():
                waiting.add(client.submit(perform_in_child, chunk, key=key, pure=False))
            under_way += 1
        if not under_way:
            return
        ready = waiting.next_batch(block=False)
        if not ready:
            time.sleep(GLANCE)
        for done in ready:
            finished = _fetched(done)
            if finished is None:
                waiting.add(done)
                continue
            under_way -= 1
            yield finished
            done.release()


class _Crew:
    """How many chunks the workers can plan at once, counted now and then, as they come and go."""

    def __init__(self, client: Any) -> None:
        self._client, self._count, self._counted = client, 0, -math.inf
        self._gone: float | None = None

    def count(self) -> int:
        """At least 1.

        Raises:
            InputError: There have been no workers for long, or there is no scheduler.
        """
        now = time.monotonic()
        if now - self._counted > RECOUNT:
            with _connected():
                threads = self._client.nthreads(callback_timeout=LONGEST_ANSWER)
            self._count, self._counted = sum(threads.values()), now
            if self._count:
                self._gone = None
            elif self._gone is None:
                self._gone = now
            elif now - self._gone > LONGEST_ABSENCE:
                raise InputError(f"all workers are lost, and no others came; {KEPT}")
        return max(1, self._count)


@contextlib.contextmanager
def _connected() -> Iterator[None]:
    """Say in words that the scheduler is lost, whatever Dask raises."""
    try:
        yield
    except (OSError, RuntimeError, asyncio.TimeoutError, asyncio.CancelledError) as error:
        raise InputError(f"{LOST}; {KEPT}") from error


def _fetched(future: Any) -> FinishedChunk | None:
    """The rows of a chunk; `None` if they were lost on the way and are planned again.

    Raises:
        InputError: There will be none.
    """
    if future.status in PLANNED_AGAIN:
        return None
    try:
        finished: FinishedChunk = future.result(timeout=LONGEST_FETCH)
    except Exception as error:  # what a chunk or Dask may raise is not known here
        late = isinstance(error, TimeoutError | asyncio.TimeoutError)
        if late and future.status not in ("error", "cancelled"):
            return None
        raise _lost(future) from None
    return finished


def _lost(future: Any) -> InputError:
    reason = LOST
    if future.status == "error":
        with contextlib.suppress(Exception):
            reason = str(future.exception())
    number = future.key.rpartition("-")[2]
    return InputError(f"chunk {number} could not be planned: {reason}; {KEPT}")


def power_of_two(count: float) -> int:
    """The largest power of two up to a number, at least 1."""
    return int(2 ** math.floor(math.log2(count))) if count >= 1 else 1
