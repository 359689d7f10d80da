"""Runs commands one after another in a process that may be ended, and says what became of each.

Each line of the input is a list of arguments in JSON, each line of the output a result. Memory is
bounded by the system, and what never ends is ended by an alarm, with the process.
"""

from __future__ import annotations

import contextlib
import faulthandler
import io
import json
import os
import resource
import sys
from pathlib import Path

MOST_BYTES = 6_000_000_000
"""Of addresses, of which libraries take some gigabytes that they never use."""
PATIENCE = 900.0
"""For a command that ends in seconds, on however slow and busy a machine [s]."""


def run(arguments: list[str]) -> dict[str, object]:
    from knotwork.cli.main import main

    out, err = io.StringIO(), io.StringIO()
    sys.argv = ["knotwork", *arguments]
    code: object = None
    fault = ""
    faulthandler.dump_traceback_later(PATIENCE, exit=True)
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as stop:
            code = stop.code
        except BaseException as error:
            fault = f"{type(error).__name__}: {error}"
    faulthandler.cancel_dump_traceback_later()
    output = out.getvalue()[:2000] + err.getvalue()[-2000:]
    return {"code": code, "fault": fault, "output": output, "kilobytes": most_memory()}


def most_memory() -> int:
    """The most memory that this process has had [kB].

    `getrusage` begins with what the process that started it has.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    results = os.fdopen(os.dup(1), "w")
    for line in sys.stdin:
        print(json.dumps(run(json.loads(line))), file=results, flush=True)
