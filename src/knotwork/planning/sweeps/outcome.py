"""Outcomes of rows: a verdict, the reason of a failure, and figures."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

from knotwork import errors
from knotwork.files.documents import Document, Edits
from knotwork.planning import Plan, plan
from knotwork.planning.sweeps.field_path import scenario_with
from knotwork.planning.sweeps.figures import FIGURES

ROW_PASSED = "passed"
"""Verdict on a row whose motion passes its check."""
ROW_FAILED = "failed"
"""Verdict on a row whose motion fails its check."""
ROW_REFUSED = "refused"
"""Verdict on a row without a motion."""
ROW_TIME_LIMIT = "time limit"
"""Verdict on a row that is not planned within the time limit."""
ROW_CRASHED = "crashed"
"""Verdict on a row after an internal error or the end of its process."""
ROW_WRONG_INPUT = "wrong input"
"""Reason of a row with wrong values."""
_REASONS: tuple[tuple[type[Exception], str], ...] = (
    (errors.OutOfReachError, "out of reach"),
    (errors.BranchError, "branch"),
    (errors.SingularityError, "singularity"),
    (errors.FollowingError, "path not followed"),
    (errors.CollisionError, "collision at the start"),
    (errors.TimingError, "no time found"),
    (errors.NoWayFoundError, "no way found"),
    (errors.PathError, "path not made"),
    (errors.TaskError, "task"),
    (errors.InputError, ROW_WRONG_INPUT),
)
"""Reasons by the class of the error; the first class that matches decides."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of one scenario.

    Attributes:
        verdict: `ROW_PASSED`, `ROW_FAILED`, `ROW_REFUSED`, `ROW_TIME_LIMIT` or `ROW_CRASHED`.
        reason: Reason of a failure, in a few words; else empty.
        message: Reason as a sentence; for a motion that passes, the number of requirements that are
            met at samples only, if any.
        figures: Figures by name, empty without a motion; `None` if the report lacks a figure.
        plan_time: Planning time [s].
    """

    verdict: str
    reason: str = ""
    message: str = ""
    figures: dict[str, float | None] = field(default_factory=dict)
    plan_time: float = 0.0


def outcome_of(document: Document, edits: Edits) -> Outcome:
    """Plan a scenario with other values, and describe the motion or the error."""
    begin = time.perf_counter()
    try:
        outcome = _with_motion(plan(scenario_with(document, edits)))
    except Exception as error:  # an internal error in one row does not stop the others
        outcome = _without_motion(error)
    return replace(outcome, plan_time=time.perf_counter() - begin)


def _with_motion(motion: Plan) -> Outcome:
    figures = {name: figure.value_of(motion) for name, figure in FIGURES.items()}
    if failures := motion.report.failures:
        return Outcome(ROW_FAILED, failures[0].quantity_text, str(failures[0]), figures)
    sampled = len(motion.report.sampled)
    verb = "is" if sampled == 1 else "are"
    message = f"{sampled} of its requirements {verb} sampled only" if sampled else ""
    return Outcome(ROW_PASSED, "", message, figures)


def _without_motion(error: Exception) -> Outcome:
    for kind, reason in _REASONS:
        if isinstance(error, kind):
            return Outcome(ROW_REFUSED, reason, str(error))
    message = f"internal error: {type(error).__name__}: {error}"
    return Outcome(ROW_CRASHED, ROW_CRASHED, message)
