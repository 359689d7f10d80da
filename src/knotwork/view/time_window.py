"""A window of time: motions cut to it, with their waypoints, knots and use of limits there."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeAlias

import numpy as np

from knotwork.errors import InputError
from knotwork.polynomial.refined import part
from knotwork.verification.limits import derivative_limits
from knotwork.view.drawn_motions import Marks, Motion, limit_uses

Window: TypeAlias = tuple[float | None, float | None]
"""From when to when [s]; `None` for the start or the end of the motion."""

WHOLE: Window = (None, None)

# A window must be at least so long, relative to the motion.
SHORTEST = 1e-6


def windowed(motions: list[Motion], window: Window) -> list[Motion]:
    """Cut motions to a window of time.

    Raises:
        InputError: The window ends before it starts, or a motion is not in it.
    """
    return motions if window == WHOLE else [_windowed(motion, window) for motion in motions]


def _windowed(motion: Motion, asked: Window) -> Motion:
    """Cut a motion to a window of time; its use of limits is that of the window.

    Raises:
        InputError: The window ends before it starts, or the motion is not in it.
    """
    start, end = (float(at) for at in motion.curve.x[[0, -1]])
    low, high = (
        edge if at is None else float(at) for edge, at in zip((start, end), asked, strict=True)
    )
    for name, at in (("starts", low), ("ends", high)):
        if not np.isfinite(at):
            raise InputError(f"the window of time {name} at {at} s; a time must be finite")
    span = f"the motion is from {start:g} s to {end:g} s"
    if high <= low and None not in asked:
        raise InputError(
            f"the window of time starts at {low:g} s and ends at {high:g} s; it must end later "
            f"than it starts, and {span}"
        )
    inner = max(low, start), min(high, end)
    if inner[1] - inner[0] <= SHORTEST * (end - start):
        how_much = "nothing" if inner[1] <= inner[0] else "too little"
        words = zip(("from", "to"), asked, strict=True)
        wanted = " ".join(f"{word} {at:g} s" for word, at in words if at is not None)
        raise InputError(f"there is {how_much} to draw {wanted}: {span}")
    trajectory = replace(
        motion.trajectory, polynomial=part(motion.curve, *inner), waypoint_times=None
    )
    judged = derivative_limits(motion.space, trajectory.polynomial)
    return replace(
        motion,
        trajectory=trajectory,
        marks=_windowed_marks(motion.marks, (low, high)),
        uses=limit_uses(judged),
        knots=motion.knots[(motion.knots >= inner[0]) & (motion.knots <= inner[1])],
        window=(low, high),
    )


def _windowed_marks(marks: Marks | None, window: tuple[float, float]) -> Marks | None:
    if marks is None:
        return None
    (kept,) = np.nonzero((marks.time >= window[0]) & (marks.time <= window[1]))
    if not len(kept):
        return None
    position, velocity = (values[kept] for values in marks.asked)
    return Marks(marks.time[kept], tuple(marks.names[i] for i in kept), (position, velocity))
