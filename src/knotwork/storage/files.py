"""Files written into a folder, all of them or none, whatever ends the process.

They are written into a hidden folder next to their places, which is then renamed: that one step
decides. Whoever reads or writes in the folder next finishes what is decided and removes all that is
not. A folder with other files of the user's own stays that folder, which is not true of a new
one that takes its place.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

from knotwork.errors import InputError

if sys.platform != "win32":
    import fcntl

_PREFIX = ".knotwork-"
UNDECIDED, DECIDED, REPLACED = ".part", ".whole", ".old"
"""Ends of the hidden folders: not yet all of the files, all of them, those that they replace."""
LONGEST_WAIT = 30.0
"""How long another writer may take [s]."""


def write_files(folder: Path | str, contents: Mapping[str, str | bytes]) -> list[Path]:
    """Write files into a folder, all of them or none; existing ones are replaced.

    Of several writers at once, the files of the last one stay, all of them.

    >>> [path.name for path in write_files("motion", {"a.txt": "one", "b.bin": b"two"})]
    ['a.txt', 'b.bin']

    Args:
        folder: Made if it does not exist.
        contents: Text, written in UTF-8, or bytes by file name.

    Returns:
        Paths of the files.

    Raises:
        InputError: The folder can't be made or written to.
    """
    with _refusing(f"can't write to {folder}", "give a folder that can be made and written to"):
        return _write(Path(folder), contents)


def write_file(
    path: Path | str, content: str | bytes, *, what: str = "", replace: bool = True
) -> Path:
    """Write one file, whole or not at all; an existing one is replaced.

    >>> write_file("motion/a.txt", "one").read_text()
    'one'

    Args:
        path: Path of the file; its folder is made if it does not exist.
        content: Text, written in UTF-8, or bytes.
        what: What it holds, for the error, such as `"a picture"`.
        replace: Whether there may be one already; if not, of several writers one alone writes.

    Raises:
        InputError: It can't be written.
    """
    path = Path(path)
    accepted = "give a file in a folder that can be made and written to"
    with _refusing(f"can't write {what + ' ' if what else ''}to {path}", accepted):
        return _write(path.parent, {path.name: content}, replace)[0]


@contextlib.contextmanager
def _refusing(failure: str, accepted: str) -> Iterator[None]:
    """Say what could not be done, why, and what can.

    Raises:
        InputError: In place of an `OSError`, or of a `ValueError`, for a name or text that no file
            can have.
    """
    try:
        yield
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{failure}: {reason}; {accepted}") from error


def _write(folder: Path, contents: Mapping[str, str | bytes], replace: bool = True) -> list[Path]:
    """Write files, all of them or none.

    Raises:
        OSError: One could not be written.
        ValueError: A name or text that no file can have.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with _alone_in(folder):
        if not replace and any((folder / name).exists() for name in contents):
            raise FileExistsError(None, "it is there already")
        token = f"{_PREFIX}{os.urandom(6).hex()}"
        new, whole, old = (folder / f"{token}{end}" for end in (UNDECIDED, DECIDED, REPLACED))
        try:
            new.mkdir()
            for name, content in contents.items():
                _write_one(new / name, content, folder / name)
            old.mkdir()
            for name in contents:
                if (folder / name).exists():
                    _link(folder / name, old / name)
            _to_disk(new)
            os.rename(new, whole)
            _to_disk(folder)
            _put_in_place(whole, folder, old)
        finally:  # what is decided and not in place, as after an interrupt, is left to the next
            for left in (new, old):
                shutil.rmtree(left, ignore_errors=True)
        _to_disk(folder)
    return [folder / name for name in contents]


def _write_one(path: Path, content: str | bytes, place: Path) -> None:
    if place.is_dir():
        raise IsADirectoryError(None, f"{place.name} is a folder")
    with path.open("xb") as file:
        if place.exists():
            shutil.copymode(place, path)
        file.write(content if isinstance(content, bytes) else content.encode())
        file.flush()
        os.fsync(file.fileno())


def _link(existing: Path, other: Path) -> None:
    """Give a file another name too; where the file system can't, copy it."""
    try:
        os.link(existing, other, follow_symlinks=False)
    except OSError:
        shutil.copy2(existing, other, follow_symlinks=False)


def _put_in_place(whole: Path, folder: Path, old: Path) -> None:
    """Move new files into their places; if one can't be, put back what was there before.

    Raises:
        OSError: A file could not be moved.
    """
    moved: list[str] = []
    try:
        for name in sorted(os.listdir(whole)):
            os.replace(whole / name, folder / name)
            moved.append(name)
    except OSError:
        for name in moved:
            if (old / name).exists():
                os.replace(old / name, folder / name)
            else:
                (folder / name).unlink()
        shutil.rmtree(whole, ignore_errors=True)
        raise
    shutil.rmtree(whole, ignore_errors=True)


def finish_interrupted(folder: Path) -> None:
    """Finish what a writer that was ended had decided to write into a folder.

    Raises:
        InputError: There is something to finish, and it can't be.
    """
    failure = f"writing to {folder} was interrupted, and can't be finished"
    with _refusing(failure, "plan again into another folder"):
        if any(name.endswith(DECIDED) for name in _left_in(folder)):
            with _alone_in(folder):
                pass


def _left_in(folder: Path) -> list[str]:
    """Hidden folders that writers left behind.

    A link of such a name is none: where a stranger made it, it leads to files of the user's own.
    """
    if not folder.is_dir():
        return []
    ends = (UNDECIDED, DECIDED, REPLACED)
    with os.scandir(folder) as entries:  # which knows the kind even of what has gone meanwhile
        ours = [one for one in entries if one.name.startswith(_PREFIX) and one.name.endswith(ends)]
        return [one.name for one in ours if one.is_dir(follow_symlinks=False)]


@contextlib.contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Be the only writer in a folder; whatever others left there is of processes that have ended.

    The lock is the system's, on the folder itself, and ends with the process.

    Raises:
        OSError: Another process writes there for longer than `LONGEST_WAIT`.
    """
    if sys.platform == "win32":  # it has no locks on folders
        yield
        return
    number = os.open(folder, os.O_RDONLY)
    try:
        if _locked(number, folder):
            for name in _left_in(folder):
                if name.endswith(DECIDED):
                    for file in sorted(os.listdir(folder / name)):
                        os.replace(folder / name / file, folder / file)
                shutil.rmtree(folder / name, ignore_errors=True)
        yield
    finally:
        os.close(number)


def _locked(number: int, folder: Path) -> bool:
    """Lock an open folder; whether the file system can."""
    if sys.platform == "win32":
        return False
    give_up = time.monotonic() + LONGEST_WAIT
    while True:
        try:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            if time.monotonic() > give_up:
                raise BlockingIOError(None, "another process is writing there") from None
            time.sleep(0.01)
        except OSError:  # some network file systems have no locks on folders
            return False


def _to_disk(folder: Path) -> None:
    """Have a folder's list of files survive a power cut, where the file system can."""
    with contextlib.suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)
