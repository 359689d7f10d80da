"""What became of one scenario: its verdict, the reason of a failure, and its figures."""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import dataclass, field

from knotwork import errors
from knotwork.documents import Location
from knotwork.errors import InputError
from knotwork.pipeline import Plan, plan
from knotwork.scenario import Scenario
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


def outcome_of(scenario: Scenario, varied: Collection[Location] = ()) -> Outcome:
    """Plan a scenario in which some places are varied, and say what became of it, whatever."""
    begin = time.perf_counter()
    try:
        made = plan(scenario)
    except InputError as error:
        return refused(error, time.perf_counter() - begin)
    except Exception as error:  # a fault of Knotwork in one row is not the end of the others
        return crashed(error, time.perf_counter() - begin)
    return judged(made, varied, time.perf_counter() - begin)


def judged(made: Plan, varied: Collection[Location], plan_time: float) -> Outcome:
    """The outcome of a motion."""
    figures = row_figures(made, varied)
    failures = made.report.failures
    if not failures:
        return Outcome(PASSED, "", _reservation(len(made.report.sampled)), figures, plan_time)
    return Outcome(FAILED, failures[0].title, str(failures[0]), figures, plan_time)


def _reservation(sampled: int) -> str:
    """What to know of a row that passes."""
    if not sampled:
        return ""
    return f"{sampled} of its requirements {'is' if sampled == 1 else 'are'} sampled only"


def crashed(error: Exception, plan_time: float = 0.0) -> Outcome:
    """The outcome of a scenario that Knotwork has a fault with."""
    message = f"internal error: {type(error).__name__}: {error}"
    return Outcome(CRASHED, CRASHED, message, {}, plan_time)


def refused(error: InputError, plan_time: float = 0.0) -> Outcome:
    """The outcome of a scenario that there is no motion for."""
    reason = next(name for kind, name in _REASONS if isinstance(error, kind))
    return Outcome(REFUSED, reason, str(error), {}, plan_time)
