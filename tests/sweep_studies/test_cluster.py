"""Studies by several processes and by a Dask cluster, some of whose processes are killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil
import pytest
from tasks import LIFT, all_end, planning, without_time

import knotwork as kw
from patience import PATIENCE

pytestmark = [
    pytest.mark.exhaustive,
    pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL"),
]

TASK = {**LIFT, "planner": "quintic:estimated"}
VARY: dict[str, Any] = {
    "waypoints[up].after": "0.5:3:24",
    "waypoints[up].joints.lift": "uniform(0.5, 1.5)",
}
OPTIONS: dict[str, Any] = {"samples": 10, "seed": 5}


def cluster_of(workers: int, threads: int) -> Any:
    """A cluster of this machine, to be used by its address."""
    import distributed

    return distributed.LocalCluster(
        n_workers=workers, threads_per_worker=threads, dashboard_address=":0", silence_logs=50
    )


@pytest.fixture(scope="module")
def serial() -> Any:
    """The rows as one process makes them, without Dask."""
    return without_time(kw.sweep(TASK, VARY, workers=0, **OPTIONS))


@pytest.mark.parametrize("lost", [0, 1])
def test_an_interrupt_ends_all_and_says_how_to_go_on(lost: int, tmp_path: Path) -> None:
    """Also where a process has taken the place of a lost one."""
    folder = tmp_path / "study"
    command = ["sweep", "ur5_deburring", "--vary", "frames.block.position[0]=400:500:3000"]
    run = subprocess.Popen(
        [sys.executable, "-m", "knotwork", *command, "--workers", "2", "--out", str(folder)],
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while not (folder / "rows.jsonl").exists():
        assert run.poll() is None
        time.sleep(0.05)
    this, before = psutil.Process(run.pid), planning(psutil.Process(run.pid))
    for child in before[:lost]:
        child.kill()
    while lost and not any(one not in before for one in planning(this)):
        assert run.poll() is None
        time.sleep(0.05)
    below = this.children(recursive=True)
    os.killpg(run.pid, signal.SIGINT)
    out, errors = run.communicate(timeout=PATIENCE)
    assert (run.returncode, out) == (130, "")
    kept = f"finished rows are kept in {folder}; continue with --resume"
    assert [line for line in errors.splitlines() if line] == [kept, "interrupted"]
    assert all_end(below)


def test_a_scheduler_by_its_address(serial: Any) -> None:
    with cluster_of(1, 2) as cluster:
        study = kw.sweep(TASK, VARY, scheduler=cluster.scheduler_address, **OPTIONS)
    assert without_time(study) == serial


def test_no_scheduler_at_an_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("knotwork.planning.sweeps.executors.CONNECT_TIMEOUT", 0.5)
    for address in ("tcp://127.0.0.1:9", "no such address"):
        with pytest.raises(kw.InputError, match=f"scheduler {address}: can't be reached"):
            kw.sweep(TASK, VARY, scheduler=address, **OPTIONS)


def test_lost_scheduler_costs_no_finished_row(serial: Any, tmp_path: Path) -> None:
    folder = tmp_path / "study"
    with cluster_of(1, 2) as cluster:

        def midway(at: kw.sweeps.SweepProgress) -> None:
            if at.done >= 60:
                cluster.close()

        address = {"scheduler": cluster.scheduler_address}
        with pytest.raises(kw.InputError, match=r"scheduler was lost.*resume the study"):
            kw.sweep(TASK, VARY, out=folder, progress=midway, **address, **OPTIONS)
    assert 60 <= len(kw.Study.open(folder)) < 240
    study = kw.sweep(TASK, VARY, out=folder, resume=True, workers=0, **OPTIONS)
    assert without_time(study) == serial
