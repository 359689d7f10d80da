"""Logs of known motions, written as other tools write them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knotwork.curves.trajectory import JointTrajectory
from knotwork.verification.recording import Smoothed, read_log, smoothed

START = 1_700_000_000.0
"""Time of the first sample since 1970 [s]."""


@dataclass(frozen=True)
class Samples:
    """What a robot has recorded: time since the first sample [s], positions."""

    names: tuple[str, ...]
    time: np.ndarray
    position: np.ndarray


def record(
    motion: JointTrajectory,
    *,
    rate: float = 125.0,
    noise: float = 0.0,
    jitter: float = 0.0,
    before: float = 0.5,
    after: float = 0.5,
    seed: int = 0,
) -> Samples:
    """Sample a motion that starts `before` seconds after the first sample; noise is normal."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, before + motion.duration + after, 1.0 / rate)
    at = time - before + motion.start_time
    inside = np.clip(at, motion.start_time, motion.end_time)
    q = motion.position(inside) + random.normal(0.0, noise, (time.size, len(motion.joint_names)))
    stamps = np.sort(time + random.normal(0.0, jitter, time.size))
    stamps[0] = 0.0
    return Samples(motion.joint_names, stamps, q)


def write(
    path: Path, samples: Samples, digits: int | None = 6, *, topic: str = "/joint_states"
) -> Path:
    """Write a log as PlotJuggler exports a topic; `None` for all digits, as in a simulator."""
    number = repr if digits is None else f"{{:.{digits}f}}".format
    start = 0.0 if digits is None else START
    stamp = repr if digits is None else "{:.6f}".format
    names = [f"{topic}/{name}/position" for name in samples.names]
    pairs = zip(samples.time.tolist(), samples.position.tolist(), strict=True)
    rows = [[stamp(start + t), *map(number, row)] for t, row in pairs]
    return write_rows(path, ["__time", *names], rows)


def write_rows(
    path: Path, headings: Sequence[str], rows: Sequence[Sequence[str]], delimiter: str = ","
) -> Path:
    path.write_text("".join(delimiter.join(row) + "\n" for row in [headings, *rows]))
    return path


def smooth(
    folder: Path,
    motion: JointTrajectory,
    samples: Samples,
    digits: int | None = 6,
    noise: float | None = None,
) -> Smoothed:
    """The curve behind a log of a motion's joints, which is written into a folder."""
    file = write(folder / "log.csv", samples, digits)
    return smoothed(read_log(file, motion.joint_names, motion.joint_units), noise)
