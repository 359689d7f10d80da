"""The best sequence of IK solutions whose motion is collision-free, or motions around obstacles."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from knotwork.errors import InputError, NoWayFoundError, TimingError
from knotwork.errors.plain_text import quoted_waypoint
from knotwork.planning.avoidable_collisions import find_avoidable_ends
from knotwork.planning.planned_motion import Plan
from knotwork.planning.sequence_planner import SequencePlanner
from knotwork.planning.task_to_joint import SequenceStep, TaskSolution
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.resolve import change_task
from knotwork.verification.collisions import failed_pairs
from knotwork.verification.finding import REMEDIES_TRIED, Group, Topic

MAX_SEQUENCES_WITHOUT_UNKNOWNS = 12
"""Maximum number of sequences of solutions to plan if no value is unknown."""

MAX_SEQUENCES_WITH_UNKNOWNS = 4
"""Maximum number of sequences of solutions to plan if any value is unknown."""


@dataclass(frozen=True, eq=False)
class SequenceAttempt:
    """A sequence of solutions, and the motion planned through it.

    Attributes:
        plan: The motion, or `None` if none was found.
        blocked_steps: Steps with a collision or without a motion, which the next sequence must
            avoid. If it is empty, no other sequence is worth planning.
        error: The reason why no motion was found, or `None`.
    """

    plan: Plan | None
    blocked_steps: Sequence[SequenceStep]
    error: InputError | None = None


def best_of_sequences(sequence_planner: SequencePlanner) -> Plan:
    """Plan the best sequence of solutions whose motion is collision-free.

    Sequences are planned, the best first, each without the steps that were blocked before, until
    one is clear and within the limits. Of these plans, the one with the fewest colliding pairs is
    kept. If it collides, motions with chosen times are planned again with `way: clear`, and replace
    it if fewer pairs collide then. The report lists these attempts.

    Raises:
        NoWayFoundError, TimingError: For the best sequence, if none of them has a motion.
        InputError: The task is wrong.
    """
    first = sequence_planner.solve()
    attempts = [_attempt(sequence_planner, first)]
    while (solution := _next_sequence(sequence_planner, first, attempts)) is not None:
        try:
            attempts.append(_attempt(sequence_planner, solution))
        except InputError as error:
            attempts.append(SequenceAttempt(None, (), error))
    plans = [attempt.plan for attempt in attempts if attempt.plan is not None]
    if not plans:
        reason = next(attempt.error for attempt in attempts if attempt.error is not None)
        if isinstance(reason, TimingError) and len(attempts) > 1:
            reason.hint = f"this is the best of {len(attempts)} sequences of solutions tried"
        raise reason
    best = min(plans, key=_rank)
    if failed_pairs(best.report.findings):
        return _around_obstacles(sequence_planner, best, attempts)
    if len(attempts) == 1:
        return best
    outcome = "collides" if attempts[0].plan is not None else "was not found"
    return _with_finding(
        best,
        f"the motion of the best sequence of solutions {outcome}; of {len(attempts)} sequences "
        "tried this is the first that is collision-free",
    )


def _attempt(sequence_planner: SequencePlanner, solution: TaskSolution) -> SequenceAttempt:
    """Plan a sequence of solutions.

    Raises:
        InputError: The sequence can't be planned.
    """
    try:
        plan = sequence_planner.plan(solution)
    except NoWayFoundError as error:
        if error.between is None:
            return SequenceAttempt(None, (), error)
        return SequenceAttempt(None, _steps(solution, range(*error.between)), error)
    except TimingError as error:
        indices = [fault.waypoint_index for fault in (error, *error.others) if fault.in_interval]
        return SequenceAttempt(None, _steps(solution, [i for i in indices if i is not None]), error)
    solution = plan.solution or solution
    return SequenceAttempt(
        plan, [] if solution.collisions else _steps(solution, _colliding_intervals(plan))
    )


def _steps(solution: TaskSolution, intervals: Iterable[int]) -> list[SequenceStep]:
    """Steps of a solution in some intervals; none if no other sequence is worth planning."""
    q = solution.sequence
    return [] if q is None else [(i, q[i], q[i + 1]) for i in intervals]


def _next_sequence(
    sequence_planner: SequencePlanner, first: TaskSolution, attempts: Sequence[SequenceAttempt]
) -> TaskSolution | None:
    """The best sequence without blocked steps, or `None` if no other one is to be planned."""
    has_unknowns = sequence_planner.scenario.unknowns is not None
    count = MAX_SEQUENCES_WITH_UNKNOWNS if has_unknowns else MAX_SEQUENCES_WITHOUT_UNKNOWNS
    is_last = len(attempts) == count or sequence_planner.budget.has_ended
    if is_last or not attempts[-1].blocked_steps:
        return None
    blocked_steps = [step for attempt in attempts for step in attempt.blocked_steps]
    following = sequence_planner.solve(blocked_steps)
    takes_blocked_step = following.collisions > first.collisions
    return None if following.sequence is None or takes_blocked_step else following


def _colliding_intervals(plan: Plan) -> list[int]:
    """Intervals between waypoints in which a plan collides."""
    times = plan.scenario.times
    pairs = failed_pairs(plan.report.findings)
    collisions = [p.shown_time for p in pairs if p.shown_time is not None]
    after = np.searchsorted(times, collisions, side="right")
    return sorted({int(i) for i in np.clip(after - 1, 0, len(times) - 2)})


def _around_obstacles(
    sequence_planner: SequencePlanner, best: Plan, attempts: Sequence[SequenceAttempt]
) -> Plan:
    """A plan around the obstacles that every sequence hits, or the best plan and the attempts."""
    ended_before = sequence_planner.budget.has_ended
    unknowns = sequence_planner.scenario.unknowns
    waypoint_unknowns = unknowns.at_waypoints if unknowns else ()
    notes: list[str] = []
    avoidable = find_avoidable_ends(best, sequence_planner.scenario)
    attempted = [
        i
        for i in avoidable
        if waypoint_unknowns and waypoint_unknowns[i].duration_is_unknown and not ended_before
    ]
    if attempted:
        try:
            detour = best_of_sequences(_with_clear_motions(sequence_planner, attempted))
        except InputError as error:
            notes.append(f"way: clear finds no motion either: {error}")
        else:
            if _rank(detour) < _rank(best):
                names = _quoted_names(best.scenario, attempted)
                return _with_finding(
                    detour, f"the fastest motion collides, so way: clear was taken at {names}"
                )
    untried = [i for i in avoidable if i not in attempted]
    if untried and not best.scenario.scene.has_moving_bodies:
        notes.append(_advice(sequence_planner.scenario, untried))
    if len(attempts) > 1:
        notes.append(_note_on_attempts(attempts, ended_before=ended_before))
    elif ended_before:
        notes.append("the budget ended before another sequence of solutions was tried")
    return _with_finding(best, "; ".join(notes), REMEDIES_TRIED) if notes else best


def _advice(scenario: Scenario, untried: Sequence[int]) -> str:
    """Advice to plan with `way: clear` at waypoints, by index."""
    unknowns = scenario.unknowns
    end_unknowns = [unknowns.at_waypoints[i] for i in untried] if unknowns else []
    # motions joined at an unknown velocity are one motion, which takes no times
    is_joined = any(end.velocity_kind == "unknown" for end in end_unknowns)
    has_times = not all(end.duration_is_unknown for end in end_unknowns)
    condition = " without times" if is_joined and has_times else ""
    collisions = "the collision" if len(untried) == 1 else "the collisions"
    names = _quoted_names(scenario, untried)
    return f"way: clear at {names}{condition} may avoid {collisions} (not attempted)"


def _note_on_attempts(attempts: Sequence[SequenceAttempt], *, ended_before: bool) -> str:
    """Text of the number of sequences tried, and whether the budget ended then."""
    when = " when the budget ended" if ended_before else ""
    failed = sum(attempt.plan is None for attempt in attempts)
    without_motion = f", {failed} of them without a motion" if failed else ""
    return (
        f"sequences of solutions tried{when}: {len(attempts)}{without_motion}; "
        "this one has the fewest colliding pairs"
    )


def _with_clear_motions(
    sequence_planner: SequencePlanner, indices: Sequence[int]
) -> SequencePlanner:
    """The planner of the scenario with `way: clear` at some waypoints, by index."""
    scenario = sequence_planner.scenario
    ways = {scenario.task_index[i]: {"way": "clear"} for i in indices}
    return sequence_planner.with_scenario(change_task(scenario, scenario.task.with_waypoints(ways)))


def _rank(plan: Plan) -> tuple[int, int]:
    """Number of colliding pairs and of failures, by which plans are compared; smaller is better."""
    return len(failed_pairs(plan.report.findings)), len(plan.report.failures)


def _quoted_names(scenario: Scenario, indices: Sequence[int]) -> str:
    return " and ".join(quoted_waypoint(scenario.waypoints[i].name) for i in indices)


def _with_finding(plan: Plan, message: str, quantity: str = "sequences_tried") -> Plan:
    """The plan with a finding on the planned sequences of solutions."""
    finding = Topic(Group.COLLISIONS).finding(quantity, message)
    report = replace(plan.report, findings=(*plan.report.findings, finding))
    return replace(plan, report=report)
