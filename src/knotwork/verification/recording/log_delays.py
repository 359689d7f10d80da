"""Delay of a log relative to its plan, over the time of the plan.

The delay at each time of the plan is a multiple of a time step. A change of the delay costs as much
as a few samples far off the plan, so that the delay changes only with evidence in the log. Dynamic
programming (Viterbi) finds the cheapest sequence of delays. In each span of constant delay, the
delay is then improved by least squares. The plan is at rest before its start and after its end.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from knotwork.arrays import BoolArray, FloatArray
from knotwork.curves.trajectory import JointTrajectory
from knotwork.verification.recording.smoothing import Smoothed

MAX_PLAN_STEPS = 1000
"""Maximum number of time steps of the plan."""
CHANGE_COST = 10.0
"""Cost of a change of the delay, in mean squares of the plan's motion in one time step."""
EVIDENCE = 0.25
"""Fraction of the sum of squares of a constant delay, below which several delays count."""
MIN_DELAY_STEPS = 3.0
"""Minimum difference of two delays, in time steps; with a smaller one they are equal."""
MAX_FIT_ITERATIONS = 50
"""Maximum number of Gauss-Newton iterations."""


class Delay(NamedTuple):
    """A span of the plan with a constant delay.

    Attributes:
        start, end: Span in the plan's time [s].
        delay: Delay since the plan's time or, while it is estimated, since the log's first sample
            [s]; negative if early.
    """

    start: float
    end: float
    delay: float


def plan_at(plan: JointTrajectory, time: FloatArray, order: int = 0) -> FloatArray:
    """Evaluate a plan at any times; it is at rest before and after its own."""
    inside = np.clip(time, plan.start_time, plan.end_time)
    values = plan(inside, order)
    if order:
        values = np.where((inside == time)[:, None], values, 0.0)
    return np.asarray(values)


def estimate_delays(curve: Smoothed, plan: JointTrajectory, shift: float) -> tuple[Delay, ...]:
    """Estimate the delays of a log over time since its first sample, as spans of constant delay.

    Args:
        curve: The smoothed log.
        plan: The plan, with the log's joints in its order.
        shift: Time since the log's first sample at time 0 of the plan [s].

    Returns:
        Spans in order of time; a single span without evidence of several delays.
    """
    constant = Delay(plan.start_time, plan.end_time, shift)
    step = max(curve.log.period, plan.duration / MAX_PLAN_STEPS)
    time = np.arange(plan.start_time, plan.end_time, step)
    reach = len(time)
    ahead = np.arange(-reach, len(time) + reach + 1) * step + plan.start_time + shift
    log = curve.trajectory.position(np.clip(ahead, 0.0, curve.log.time[-1]))
    moves = float((plan.velocity(time) ** 2).sum(axis=1).mean()) * step**2
    cost = CHANGE_COST * (moves + float((curve.noise.position**2).sum()))
    steps = _cheapest_delays(plan.position(time), log, reach, cost)
    spans = _constant_spans(steps * step, np.append(time, plan.end_time), step)
    if len(spans) < 2:
        return (constant,)
    spans = [span._replace(delay=shift + span.delay) for span in spans]
    spans = [span._replace(delay=fit_delay(curve, plan, span, 1)[0]) for span in spans]
    squares = float((_residuals(curve, plan, constant) ** 2).sum())
    several = sum(float((_residuals(curve, plan, span) ** 2).sum()) for span in spans)
    return tuple(spans) if several < EVIDENCE * squares else (constant,)


def fit_delay(
    curve: Smoothed, plan: JointTrajectory, span: Delay, max_iterations: int = MAX_FIT_ITERATIONS
) -> tuple[float, float]:
    """Delay of a span since the log's first sample, and its standard error [s].

    The delay is fitted to the span's samples by least squares (Gauss-Newton). One iteration is
    sufficient if the delay is known to the sample period.
    """
    delay, samples = span.delay, _samples_in(curve, span)
    time, q = curve.log.time[samples], curve.log.position[samples]
    for _ in range(max_iterations):
        slopes = plan_at(plan, time - delay, 1)
        residuals = q - plan_at(plan, time - delay)
        weight = float((slopes**2).sum())
        if weight == 0.0:
            return delay, np.inf
        step = float((slopes * residuals).sum()) / weight
        delay -= step
        if abs(step) < 1e-12 * max(1.0, abs(delay)):
            break
    moving = slopes.any(axis=1)
    return delay, float(np.sqrt((residuals[moving] ** 2).mean() / weight))


def _samples_in(curve: Smoothed, span: Delay) -> BoolArray:
    """Whether each sample of the log is in a span, shape (n,)."""
    planned_time = curve.log.time - span.delay
    return (planned_time >= span.start) & (planned_time < span.end)


def _residuals(curve: Smoothed, plan: JointTrajectory, span: Delay) -> FloatArray:
    """Samples of a span minus the plan, shape (k, d)."""
    samples = _samples_in(curve, span)
    planned_time = curve.log.time[samples] - span.delay
    return curve.log.position[samples] - plan.position(planned_time)


def _cheapest_delays(plan: FloatArray, log: FloatArray, reach: int, cost: float) -> FloatArray:
    """The delay at each of the plan's times, in time steps, shape (m,)."""
    count = 2 * reach + 1
    total = np.zeros(count)
    stays = np.empty((len(plan), count), dtype=bool)
    best = np.empty(len(plan), dtype=np.intp)
    for j, q in enumerate(plan):
        best[j] = total.argmin()
        changed = total[best[j]] + cost
        stays[j] = total <= changed
        total = np.minimum(total, changed) + ((log[j : j + count] - q) ** 2).sum(axis=1)
    delay = np.empty(len(plan))
    k = int(total.argmin())
    for j in range(len(plan) - 1, -1, -1):
        delay[j] = k - reach
        k = k if stays[j, k] else int(best[j])
    return delay


def _constant_spans(delays: FloatArray, time: FloatArray, step: float) -> list[Delay]:
    """Spans with a nearly constant delay, from the delay [s] after each time but the last."""
    spans: list[Delay] = []
    cuts = [0, *(np.flatnonzero(np.diff(delays)) + 1).tolist(), len(delays)]
    for i, k in pairwise(cuts):
        end = float(time[k])
        if spans and abs(delays[i] - spans[-1].delay) < MIN_DELAY_STEPS * step:
            spans[-1] = spans[-1]._replace(end=end)
        else:
            spans.append(Delay(float(time[i]), end, float(delays[i])))
    return spans


def delay_text(spans: tuple[Delay, ...]) -> str:
    """Delays in words, such as "0.4 s late from 29.3 s on"; empty without any."""
    worst = max(spans, key=lambda span: abs(span.delay))
    if worst.delay == 0.0:
        return ""
    similar = [span.delay * worst.delay > 0.5 * worst.delay**2 for span in spans]
    middle = spans.index(worst)
    first = next((i + 1 for i in range(middle, -1, -1) if not similar[i]), 0)
    last = next((i - 1 for i in range(middle, len(spans)) if not similar[i]), len(spans) - 1)
    up_to = "up to " if first < last or len(spans) > 3 else ""
    to = "on" if last + 1 == len(spans) else f"to {spans[last].end:.4g} s"
    word = "late" if worst.delay > 0.0 else "early"
    return f"{up_to}{abs(worst.delay):.3g} s {word} from {spans[first].start:.4g} s {to}"
