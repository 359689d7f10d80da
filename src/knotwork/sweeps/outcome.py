"""What became of one scenario: its verdict, the reason of a failure, and its figures."""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import dataclass, field

from knotwork import errors
from knotwork.documents import Document, Edits, Location
from knotwork.pipeline import Plan, plan
from knotwork.sweeps.field_path import varied
from knotwork.sweeps.reach import out_of_reach
from knotwork.sweeps.shared_rest import row_figures

PASSED, FAILED, REFUSED, TIME_LIMIT, CRASHED = VERDICTS = (
    "passed",
    "failed",
    "refused",
    "time limit",
    "crashed",
)
"""All checks pass; one fails; there is no motion; it took too long; the process came to its end."""

OUT_OF_REACH, WRONG_INPUT = "out of reach", "wrong input"
# The first class that an error is of.
_REASONS: tuple[tuple[type[Exception], str], ...] = (
    (errors.OutOfReachError, OUT_OF_REACH),
    (errors.BranchError, "branch"),
    (errors.SingularityError, "singularity"),
    (errors.FollowingError, "path not followed"),
    (errors.CollisionError, "collision at the start"),
    (errors.TimingError, "no time found"),
    (errors.PathError, "path not made"),
    (errors.TaskError, "task"),
    (errors.InputError, WRONG_INPUT),
)


@dataclass(frozen=True)
class Outcome:
    """What became of one scenario.

    Attributes:
        verdict: One of `VERDICTS`.
        reason: What fails, in few words; empty if nothing does.
        message: The same in a sentence; of a motion that passes, how much of it is sampled only.
        figures: By name; `None` where there is no motion, or the report does not have it.
        plan_time: Time that it took [s].
    """

    verdict: str
    reason: str = ""
    message: str = ""
    figures: dict[str, float | None] = field(default_factory=dict)
    plan_time: float = 0.0


def outcome_of(document: Document, edits: Edits) -> Outcome:
    """Plan a document with other values, if its poses are not out of reach."""
    begin = time.perf_counter()
    try:
        scenario = varied(document, edits)
        if message := out_of_reach(scenario):
            return Outcome(REFUSED, OUT_OF_REACH, message)
        made = plan(scenario)
        return _judged(made, edits, time.perf_counter() - begin)
    except Exception as error:  # a fault of Knotwork in one row is not the end of the others
        return _without_motion(error, time.perf_counter() - begin)


def _judged(made: Plan, varied: Collection[Location], plan_time: float) -> Outcome:
    figures, failures = row_figures(made, varied), made.report.failures
    if failures:
        return Outcome(FAILED, failures[0].title, str(failures[0]), figures, plan_time)
    sampled = len(made.report.sampled)
    are = "is" if sampled == 1 else "are"
    message = f"{sampled} of its requirements {are} sampled only" if sampled else ""
    return Outcome(PASSED, "", message, figures, plan_time)


def _without_motion(error: Exception, plan_time: float) -> Outcome:
    for kind, reason in _REASONS:
        if isinstance(error, kind):
            return Outcome(REFUSED, reason, str(error), {}, plan_time)
    message = f"internal error: {type(error).__name__}: {error}"
    return Outcome(CRASHED, CRASHED, message, {}, plan_time)
