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
    path: Path,
    samples: Samples,
    digits: int = 6,
    *,
    topic: str = "/joint_states",
) -> Path:
    """Write a log as PlotJuggler exports a topic."""
    names = [f"{topic}/{name}/position" for name in samples.names]
    return write_rows(
        path,
        ["__time", *names],
        [
            [f"{START + t:.6f}", *(f"{value:.{digits}f}" for value in row)]
            for t, row in zip(samples.time, samples.position, strict=True)
        ],
    )


def write_exactly(path: Path, samples: Samples, unit: str = "") -> Path:
    """Write a log as simulators do, with all digits of each number."""
    rows = np.column_stack([samples.time, samples.position]).tolist()
    headings = [f"{name} {unit}".strip() for name in samples.names]
    return write_rows(path, ["time", *headings], [[repr(value) for value in row] for row in rows])


def write_rows(
    path: Path, headings: Sequence[str], rows: Sequence[Sequence[str]], delimiter: str = ","
) -> Path:
    path.write_text("".join(delimiter.join(row) + "\n" for row in [headings, *rows]))
    return path


def smooth(file: Path, motion: JointTrajectory, noise: float | None = None) -> Smoothed:
    """The curve behind a log of a motion's joints."""
    return smoothed(read_log(file, motion.joint_names, motion.joint_units), noise)
