"""Runs commands one after another in a process that may be ended, and says what became of each.

Each line of the input is a list of arguments in JSON, each line of the output a result. Memory is
bounded by the system, time by an alarm that ends the process.
"""

from __future__ import annotations

import contextlib
import faulthandler
import io
import json
import os
import resource
import sys
import time

MOST_BYTES = 6_000_000_000
"""Of addresses, of which libraries take some gigabytes that they never use."""
MOST_WALL = 120.0


def run(arguments: list[str]) -> dict[str, object]:
    from knotwork.cli.main import main

    out, err = io.StringIO(), io.StringIO()
    sys.argv = ["knotwork", *arguments]
    begun = time.process_time()
    code: object = None
    fault = ""
    faulthandler.dump_traceback_later(MOST_WALL, exit=True)
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as stop:
            code = stop.code
        except BaseException as error:
            fault = f"{type(error).__name__}: {error}"
    faulthandler.cancel_dump_traceback_later()
    seconds = time.process_time() - begun
    said = out.getvalue()[:2000] + err.getvalue()[-2000:]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {"code": code, "fault": fault, "seconds": seconds, "said": said, "kilobytes": peak}


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    results = os.fdopen(os.dup(1), "w")
    for line in sys.stdin:
        print(json.dumps(run(json.loads(line))), file=results, flush=True)
