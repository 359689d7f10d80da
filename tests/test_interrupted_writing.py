"""Files are whole whatever ends the process that writes them, and a set says if it is mixed."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from command_line import Command
from knotwork import Plan
from knotwork.files import storage

NAMES = ("a", "b", "c")
# Ends the process at its n-th step that changes a folder, as a power cut or Ctrl-C would.
CUT = """
import os, signal, sys
from knotwork.files import storage
steps = int(sys.argv[3])
def counted(function):
    def step(*arguments, **options):
        global steps
        steps -= 1
        if steps == 0 and sys.argv[4] == "interrupt":
            raise KeyboardInterrupt
        if steps == 0 and sys.argv[4] == "full":
            raise OSError(28, "No space left on device")
        if steps == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return function(*arguments, **options)
    return step
for name in ("mkdir", "replace", "link", "fsync"):
    setattr(os, name, counted(getattr(os, name)))
storage.write_files(sys.argv[1], {name: sys.argv[2] for name in "abc"})
sys.exit(steps <= 0)  # a step that may fail has failed
"""


@pytest.mark.parametrize("how", ["kill", "interrupt", "full"])
def test_a_writer_ended_at_any_step_leaves_whole_files(how: str, tmp_path: Path) -> None:
    """And after an interrupt from the keyboard, or on a full disk, nothing else."""
    seen = set()
    for steps in range(1, 100):
        folder = tmp_path / str(steps)
        storage.write_files(folder, dict.fromkeys(NAMES, "old"))
        command = [sys.executable, "-c", CUT, str(folder), "new", str(steps), how]
        ran = subprocess.run(command, check=False, stderr=subprocess.DEVNULL)
        found = {(folder / name).read_text() for name in NAMES}
        assert found <= {"old", "new"}
        if how != "kill":
            assert not [path.name for path in folder.iterdir() if path.name.startswith(".")]
        seen |= found
        if ran.returncode == 0:
            break
    else:
        pytest.fail("it never came to its end")
    assert seen == {"old", "new"}
    assert steps > 6


def test_the_report_says_which_files_it_is_of(
    paper_case: Plan, tmp_path: Path, knotwork: Command
) -> None:
    paper_case.save(tmp_path)
    stated = json.loads((tmp_path / "report.json").read_text())["files"]
    for name in ("trajectory.json", "samples.csv"):
        digest = hashlib.sha256((tmp_path / name).read_bytes()).hexdigest()
        assert stated[name] == f"sha256:{digest}"
    for source in (tmp_path, tmp_path / "trajectory.json", tmp_path / "samples.csv"):
        assert "note" not in knotwork("check", source, "--scenario", "paper_case").err
    for name in ("trajectory.json", "samples.csv"):
        with (tmp_path / name).open("a") as file:
            file.write("\n")
        ran = knotwork("check", tmp_path / name, "--scenario", "paper_case")
        assert "is not the file that report.json next to it was written with" in ran.err
    ran = knotwork("plot", tmp_path, "-o", tmp_path / "a.png")
    assert ran.err.count("note") == 1
    storage.load_trajectory(tmp_path)
    assert "was changed since" in str(storage.set_disagreement(tmp_path))
    (tmp_path / "report.json").unlink()
    assert storage.set_disagreement(tmp_path) is None
