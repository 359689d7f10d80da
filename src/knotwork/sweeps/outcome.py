"""What became of one scenario: its verdict, the reason of a failure, and its figures."""

from __future__ import annotations

from dataclasses import dataclass, field

from knotwork import errors
from knotwork.pipeline import Plan
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


def judged(made: Plan, plan_time: float) -> Outcome:
    """The outcome of a motion."""
    figures, failures = row_figures(made), made.report.failures
    if failures:
        return Outcome(FAILED, failures[0].title, str(failures[0]), figures, plan_time)
    sampled = len(made.report.sampled)
    are = "is" if sampled == 1 else "are"
    message = f"{sampled} of its requirements {are} sampled only" if sampled else ""
    return Outcome(PASSED, "", message, figures, plan_time)


def without_motion(error: Exception, plan_time: float = 0.0) -> Outcome:
    """The outcome of a scenario that there is no motion for, or that Knotwork has a fault with."""
    for kind, reason in _REASONS:
        if isinstance(error, kind):
            return Outcome(REFUSED, reason, str(error), {}, plan_time)
    message = f"internal error: {type(error).__name__}: {error}"
    return Outcome(CRASHED, CRASHED, message, {}, plan_time)
