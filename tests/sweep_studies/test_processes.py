"""Processes that plan are ended by others, or their parent is, or it is interrupted."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from tasks import LIFT, all_end, planning

from patience import PATIENCE

pytestmark = [
    pytest.mark.exhaustive,
    pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL"),
]

# A check that says that it has begun, and hangs.
HANGING = """
import os, pathlib, time
from knotwork.verification import CHECKS

def hanging(motion, scenario, joints):
    pathlib.Path(os.environ["BEGUN"]).touch()
    time.sleep(10_000)
    return ()

CHECKS["hanging"] = hanging
"""
RUNS = {
    "sweep": "kw.sweep(task, {'rate': [100]}, workers=1, time_limit=10_000)",
    "plan_many": "kw.plan_many([task] * 3, workers=1, time_limit=10_000)",
}
RUN = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
import knotwork as kw
from knotwork.verification import CHECKS
CHECKS.pop("hanging", None)
task = {task!r}
{run}
"""


@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT])
def test_what_hangs_ends_with_its_parent(name: str, end: signal.Signals, tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(HANGING, encoding="utf-8")
    begun = tmp_path / "begun"
    paths = os.pathsep.join((str(tmp_path), *sys.path[1:]))
    run = subprocess.Popen(
        [sys.executable, "-c", RUN.format(task=LIFT, run=RUNS[name])],
        env={**os.environ, "PYTHONPATH": paths, "BEGUN": str(begun)},
        stderr=subprocess.DEVNULL,
    )
    while not begun.exists():
        assert run.poll() is None
        time.sleep(0.05)
    below = planning(psutil.Process(run.pid))
    assert below
    run.send_signal(end)
    assert run.wait(timeout=PATIENCE) == -end
    assert all_end(below)
