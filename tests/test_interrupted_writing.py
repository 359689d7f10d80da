"""Files of a plan are one set, whatever ends the process that writes them and whoever else does."""

from __future__ import annotations

import fcntl
import hashlib
import json
import math
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from command_line import Command
from knotwork import Plan, storage
from knotwork.errors import InputError
from sweeps import first_of

NAMES = ("a", "b", "c")
WRITER = """
import sys
from knotwork import storage
text = sys.argv[2]
print(flush=True)
while True:
    storage.write_files(sys.argv[1], {name: text * 50_000 for name in "abc"})
"""
# Ends the process at its n-th step that changes a folder, as a power cut or Ctrl-C would.
CUT = """
import os, signal, sys
from knotwork import storage
steps = int(sys.argv[3])
def counted(function):
    def step(*arguments, **options):
        global steps
        steps -= 1
        if steps == 0 and sys.argv[4] == "interrupt":
            raise KeyboardInterrupt
        if steps == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return function(*arguments, **options)
    return step
for name in ("mkdir", "rename", "replace", "link", "unlink", "rmdir", "fsync"):
    setattr(os, name, counted(getattr(os, name)))
storage.write_files(sys.argv[1], {name: sys.argv[2] for name in "abc"})
"""


def contents(folder: Path) -> set[str]:
    return {(folder / name).read_text()[:3] for name in NAMES}


def hidden(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT])
def test_a_writer_ended_at_any_step_leaves_one_whole_set(
    end: signal.Signals, tmp_path: Path
) -> None:
    """The next reader finishes what was decided, the next writer removes what was not."""
    seen = set()
    for steps in range(1, 100):
        folder = tmp_path / str(steps)
        storage.write_files(folder, dict.fromkeys(NAMES, "old"))
        (folder / "mine.txt").write_text("my own")
        how = "interrupt" if end == signal.SIGINT else "kill"
        command = [sys.executable, "-c", CUT, str(folder), "new", str(steps), how]
        ran = subprocess.run(command, check=False, stderr=subprocess.DEVNULL)
        storage.finish_interrupted(folder)
        found = contents(folder)
        assert len(found) == 1
        seen |= found
        storage.write_file(folder / "other", "x")
        assert not hidden(folder)
        assert contents(folder) == found
        assert (folder / "mine.txt").read_text() == "my own"
        if ran.returncode == 0:
            break
        assert ran.returncode == -end
    else:
        pytest.fail("it never came to its end")
    assert seen == {"old", "new"}
    assert steps > 15


@pytest.mark.exhaustive
def test_writers_ended_at_any_time_leave_one_whole_set(tmp_path: Path) -> None:
    rng = random.Random(1)
    storage.write_files(tmp_path, dict.fromkeys(NAMES, "aaa"))
    for i in range(40):
        command = [sys.executable, "-c", WRITER, str(tmp_path), f"{i:03d}"]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as writer:
            assert writer.stdout is not None
            writer.stdout.readline()
            time.sleep(rng.uniform(0, 0.1))
            writer.kill()
        storage.finish_interrupted(tmp_path)
        assert len({(tmp_path / name).read_text() for name in NAMES}) == 1
    storage.write_file(tmp_path / "other", "x")
    assert not hidden(tmp_path)


# The command line, which says when it begins to write.
COMMAND = """
from knotwork.cli.main import main
from knotwork.storage import files
def begun(*arguments):
    print("writing", flush=True)
    return write(*arguments)
write, files._write = files._write, begun
main()
"""
COMMANDS = {
    "plan": (12, ("plan", "{task}", "--out", "{made}")),
    "export": (5, ("export", "{task}", "-f", "json", "--force", "-o", "{made}/a.json")),
    "report": (5, ("report", "{task}", "--html", "{made}/a.html")),
}


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", COMMANDS)
def test_commands_ended_while_they_write_leave_one_whole_set(name: str, tmp_path: Path) -> None:
    """Of two scenarios in turn: never files of both, nor a part of a file."""
    made = tmp_path / "made"
    times, parts = COMMANDS[name]

    def run(task: Path, *, ended_after: float | None) -> None:
        arguments = [part.format(task=task, made=made) for part in parts]
        command = [sys.executable, "-W", "ignore", "-c", COMMAND, *arguments]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == "writing\n"
            if ended_after is not None:
                time.sleep(ended_after)
                process.kill()
            process.stdout.read()
        assert process.returncode in (0, 1, -signal.SIGKILL)

    def found() -> dict[str, bytes]:
        storage.finish_interrupted(made)
        return {path.name: path.read_bytes() for path in made.glob("[!.]*")}

    tasks, wholes = [], []
    for duration in (1, 2):
        task = tmp_path / f"{duration}.json"
        data: dict[str, object] = {"name": "task", "rate": 2e4}
        end: dict[str, object] = {"joints": {"a": 1}}
        end["after"] = duration
        task.write_text(json.dumps({**data, "waypoints": [{"joints": {"a": 0}}, end]}))
        run(task, ended_after=None)
        tasks.append(task)
        wholes.append(found())
    assert wholes[0].keys() == wholes[1].keys()
    assert wholes[0] != wholes[1]
    rng = random.Random(name)
    for i in range(times):
        run(tasks[i % 2], ended_after=rng.uniform(0, 0.03))
        assert found() in wholes
    run(tasks[0], ended_after=None)
    assert found() == wholes[0]
    assert not hidden(made)


def write_often(folder: Path, text: str, times: int) -> None:
    """Wait for the other one for as long as a slow disk takes for all it has to write."""
    pytest.MonkeyPatch().setattr("knotwork.storage.files.LONGEST_WAIT", math.inf)
    for _ in range(times):
        storage.write_files(folder, dict.fromkeys(NAMES, text))


@pytest.mark.parametrize("times", first_of(5, 100))
def test_several_writers_at_once_end_with_one_whole_set(times: int, tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    writers = [
        context.Process(target=write_often, args=(tmp_path, text, times)) for text in ("one", "two")
    ]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
        assert writer.exitcode == 0
    assert len(contents(tmp_path)) == 1
    assert not hidden(tmp_path)


def test_another_writer_that_never_ends_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("knotwork.storage.files.LONGEST_WAIT", 0.05)
    folder = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(folder, fcntl.LOCK_EX)
    with pytest.raises(InputError, match="another process is writing there"):
        storage.write_file(tmp_path / "a", "x")
    os.close(folder)
    assert not list(tmp_path.iterdir())


def test_where_folders_have_no_locks_files_are_written_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object) -> None:
        raise OSError

    monkeypatch.setattr(fcntl, "flock", none)
    storage.write_files(tmp_path, dict.fromkeys(NAMES, "new"))
    assert contents(tmp_path) == {"new"}
    assert not hidden(tmp_path)


def test_what_can_not_be_finished_is_an_error(tmp_path: Path, knotwork: Command) -> None:
    """A folder stands where a file would go."""
    (tmp_path / ".knotwork-0.whole").mkdir()
    (tmp_path / ".knotwork-0.whole" / "trajectory.json").write_text("{}")
    (tmp_path / "trajectory.json").mkdir()
    with pytest.raises(InputError, match=r"was interrupted, and can't be finished"):
        storage.finish_interrupted(tmp_path)
    assert knotwork("check", tmp_path, "-s", "paper_case").code == 2


def test_a_link_named_as_a_set_that_was_decided_moves_no_files(
    tmp_path: Path, knotwork: Command
) -> None:
    """A stranger's folder must not take away the files of who reads it."""
    own, folder = tmp_path / "own", tmp_path / "folder"
    own.mkdir(), folder.mkdir()
    (own / "key").write_text("secret")
    for name in (".knotwork-0.whole", ".knotwork-0.part"):
        (folder / name).symlink_to(own)
    (folder / ".knotwork-1.whole").write_text("no folder")
    assert knotwork("check", folder, "-s", "paper_case").code == 2
    storage.write_file(folder / "a", "x")
    assert (own / "key").read_text() == "secret"
    assert not (folder / "key").exists()


def test_a_reader_finishes_what_was_decided(
    paper_case: Plan, tmp_path: Path, knotwork: Command
) -> None:
    paper_case.save(tmp_path)
    decided = tmp_path / ".knotwork-0.whole"
    decided.mkdir()
    for name in ("trajectory.json", "samples.csv"):
        os.replace(tmp_path / name, decided / name)
    ran = knotwork("check", tmp_path, "--scenario", "paper_case")
    assert ran.code == 0, ran.err
    assert "note:" not in ran.err
    assert not hidden(tmp_path)
    assert len(list(tmp_path.iterdir())) == 3


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
