"""Delay of a log relative to its plan, over the time of the plan.

The delay at a time of the plan is one of many in even steps. A change of the delay costs as much
as some samples far off the plan, so that it changes only with evidence in the log; the cheapest
sequence of delays is found by dynamic programming (Viterbi). The delay of each span with a constant
one is then improved by least squares.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from knotwork.recording.smoothing import Smoothed
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

STEPS = 1000
"""Largest number of steps of the plan."""
CHANGE = 10.0
"""Cost of a change of the delay, in squares of the plan's motion per step."""
SURE = 0.25
"""Delays count if they reduce the squares of a constant delay below this fraction."""
LEAST = 3.0
"""Delays that differ by fewer steps are equal."""


class Delay(NamedTuple):
    """A span of the plan with a constant delay.

    Attributes:
        start, end: Span in the plan's time [s].
        late: Delay relative to the plan's clock [s]; negative if early.
    """

    start: float
    end: float
    late: float

    def less(self, late: float) -> Delay:
        """The same span, with a delay reduced by some seconds."""
        return self._replace(late=self.late - late)


def delays(curve: Smoothed, plan: JointTrajectory, shift: float) -> tuple[Delay, ...]:
    """Delays of a log over time: spans with a constant delay.

    Args:
        curve: The smoothed log.
        plan: The plan, with the log's joints in its order.
        shift: Time since the log's first sample at time 0 of the plan [s].

    Returns:
        One span without evidence of several delays.
    """
    whole = Delay(plan.start_time, plan.end_time, 0.0)
    step = max(curve.log.period, plan.duration / STEPS)
    time = np.arange(plan.start_time, plan.end_time, step)
    asked = plan.position(time)
    reach = len(time)
    ahead = np.arange(-reach, len(time) + reach + 1) * step + plan.start_time + shift
    log = curve.trajectory.position(np.clip(ahead, 0.0, curve.log.time[-1]))
    moves = float((plan.velocity(time) ** 2).sum(axis=1).mean()) * step**2
    cost = CHANGE * (moves + float((curve.noise.position**2).sum()))
    spans = _merged(_cheapest(asked, log, reach, cost), np.append(time, plan.end_time), step)
    if len(spans) < 2:
        return (whole,)
    spans = [_improved(curve, plan, shift, one) for one in spans]
    left = [_squares(curve, plan, shift, found) for found in ([whole], spans)]
    return tuple(spans) if left[1] < SURE * left[0] else (whole,)


def _cheapest(asked: FloatArray, log: FloatArray, reach: int, cost: float) -> FloatArray:
    """The delay at each of the plan's times, in steps, shape (m,)."""
    count = 2 * reach + 1
    total = np.zeros(count)
    stays = np.empty((len(asked), count), dtype=bool)
    best = np.empty(len(asked), dtype=np.intp)
    for j, q in enumerate(asked):
        best[j] = total.argmin()
        changed = total[best[j]] + cost
        stays[j] = total <= changed
        total = np.minimum(total, changed) + ((log[j : j + count] - q) ** 2).sum(axis=1)
    found = np.empty(len(asked))
    k = int(total.argmin())
    for j in range(len(asked) - 1, -1, -1):
        found[j] = k - reach
        k = k if stays[j, k] else int(best[j])
    return found


def _merged(steps: FloatArray, time: FloatArray, step: float) -> list[Delay]:
    """Spans with a nearly constant delay."""
    spans: list[Delay] = []
    cuts = [0, *(np.flatnonzero(np.diff(steps)) + 1).tolist(), len(steps)]
    for i, k in pairwise(cuts):
        late, end = float(steps[i]) * step, float(time[k])
        if spans and abs(late - spans[-1].late) < LEAST * step:
            spans[-1] = spans[-1]._replace(end=end)
        else:
            spans.append(Delay(float(time[i]), end, late))
    return spans


def _samples(
    curve: Smoothed, plan: JointTrajectory, shift: float, span: Delay
) -> tuple[FloatArray, FloatArray]:
    """Times of the plan for a span's samples, and their residuals."""
    at = curve.log.time - shift - span.late
    inside = (at >= span.start) & (at < span.end)
    return at[inside], curve.log.position[inside] - plan.position(at[inside])


def _improved(curve: Smoothed, plan: JointTrajectory, shift: float, span: Delay) -> Delay:
    """A span with the delay from least squares of its samples; one Gauss-Newton step."""
    at, off = _samples(curve, plan, shift, span)
    slopes = plan.velocity(at)
    weight = float((slopes**2).sum())
    change = float((slopes * off).sum()) / weight if weight else 0.0
    return span._replace(late=span.late - change)


def _squares(curve: Smoothed, plan: JointTrajectory, shift: float, spans: list[Delay]) -> float:
    return sum(float((_samples(curve, plan, shift, one)[1] ** 2).sum()) for one in spans)


def delay_text(spans: tuple[Delay, ...]) -> str:
    """Delays in words, such as "0.4 s late from 29.3 s on"; empty without any."""
    worst = max(spans, key=lambda one: abs(one.late))
    if worst.late == 0.0:
        return ""
    i = j = spans.index(worst)
    near = [one.late * worst.late > 0.5 * worst.late**2 for one in spans]
    while i > 0 and near[i - 1]:
        i -= 1
    while j + 1 < len(spans) and near[j + 1]:
        j += 1
    most = "up to " if i < j or len(spans) > 3 else ""
    to = "on" if j + 1 == len(spans) else f"to {spans[j].end:.4g} s"
    word = "late" if worst.late > 0.0 else "early"
    return f"{most}{abs(worst.late):.3g} s {word} from {spans[i].start:.4g} s {to}"
