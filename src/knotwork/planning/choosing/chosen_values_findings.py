"""Findings on chosen times and on collision-free motions."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from knotwork.curves.polynomial.splitting import cut_curve
from knotwork.curves.trajectory import JointTrajectory
from knotwork.joint_quantities import rate_unit
from knotwork.planning.choosing.chosen_values import ChosenValues
from knotwork.planning.choosing.path_speed_problem import SpeedBound
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.motion_segments import StoredClearMotion
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.verification import Finding, Motion
from knotwork.verification.bounds.clearance import least_clearance
from knotwork.verification.collisions import collision_model_of
from knotwork.verification.finding import Group, Topic, Verdict

SHOWN_CLEARANCE_PRECISION = 1e-5
"""Precision of the minimum clearance [m]."""

SPEED_BOUND_TEXTS: dict[str, str] = {
    SpeedBound.AT_MOST: "at_most",
    SpeedBound.ADJACENT_MOTION: "the motion before or after",
    SpeedBound.TOLERANCES: "the tolerance of the path",
}
"""Texts of bounds of a speed along a path that have no value."""

_Shares = list[tuple[str, float | None]]
"""Texts of active limits, each with its share of the time."""


def chosen_values_findings(
    chosen_values: ChosenValues, joints: ScenarioJoints
) -> Iterator[Finding]:
    """Report the duration, its gap to the lower bound, and the active limits.

    Args:
        chosen_values: The chosen values.
        joints: The joints and their limits.
    """
    unknowns = chosen_values.original_scenario.required_unknowns
    has_unknown_times = bool(np.isnan(chosen_values.original_scenario.durations).any())
    given = unknowns.total_duration is not None or not has_unknown_times
    highlight = _duration(chosen_values, given=given)
    verdict: Verdict = "warning" if chosen_values.status != "optimal" else "information"
    group = Group.CHOSEN_TIMES if has_unknown_times else Group.CHOSEN_MOTION
    fact = f"{'times' if has_unknown_times else 'motion'} chosen: {highlight}"
    yield Topic(group).finding(
        "duration", fact, verdict, value=chosen_values.duration, unit="s", highlight=highlight
    )
    if not given:
        shortest = f"{chosen_values.lower_bound:.6g} s{_conditions(chosen_values)}"
        fact = f"no motion for this task within the limits is shorter than {shortest}"
        yield Topic(group).finding("lower_bound", fact, value=chosen_values.lower_bound, unit="s")
    if unlimited := _unlimited_note(joints):
        yield Topic(group).finding("acceleration_limit", unlimited, "warning")
    if chosen_values.sections and chosen_values.assumed_jerk:
        yield Topic(group).finding("assumed_jerk", _assumed_jerk_note(chosen_values))
    times = {waypoint.name: waypoint.time for waypoint in chosen_values.scenario.waypoints}
    for (start, end), limits in _limits_by_interval(chosen_values).items():
        texts = ", ".join(_limit_text(limit, share) for limit, share in limits)
        on_path = any(share is None for _, share in limits)
        label = _longest(limits)
        yield Topic(group, "waypoint", end).finding(
            "active_limits",
            f"{start} to {end}: {'its speed is limited by ' if on_path else ''}{texts}",
            interval=(times[start], times[end]),
            short_fact=label,
            highlight=f"{start} to {end}: limited by {label}",
        )


def _duration(chosen_values: ChosenValues, *, given: bool) -> str:
    """Text of the duration, and whether it is given or the minimum."""
    text, conditions = f"{chosen_values.duration:.6g} s", _conditions(chosen_values)
    bound = f"lower bound {chosen_values.lower_bound:.6g} s{conditions}"
    better = "a smoother motion may exist" if given else f"a shorter motion may exist ({bound})"
    if given:
        text += ", as given"
    if chosen_values.status == "budget":
        return f"{text}, the best so far when the budget ended: every limit is kept, but {better}"
    if chosen_values.status == "resting":
        return f"{text}: every limit is kept, but the arm rests between waypoints, and {better}"
    if given:
        return text
    if chosen_values.optimality_gap < 1e-6:
        return f"{text}, the minimum{conditions}"
    return f"{text}, {100 * chosen_values.optimality_gap:.1f} % above the {bound}"


def _conditions(chosen_values: ChosenValues) -> str:
    """Text of the chosen speeds along paths and fixed arrivals, on which the bound depends."""
    times = {waypoint.name: waypoint.time for waypoint in chosen_values.scenario.waypoints}
    conditions = [f"{name!r} met at {times[name]:.6g} s" for name in chosen_values.fixed_arrivals]
    unknowns = chosen_values.original_scenario.required_unknowns
    if any(waypoint.path_speed_is_unknown for waypoint in unknowns.at_waypoints):
        conditions.insert(0, "these speeds along its paths")
    return f" with {', '.join(conditions)}" if conditions else ""


def _unlimited_note(joints: ScenarioJoints) -> str:
    """Text of the warning on joints without an acceleration limit; empty if all have one."""
    missing = np.isinf(joints.limits.acceleration)
    if joints.robot is None or not missing.any():
        return ""
    names = ", ".join(np.array(joints.joint_names)[missing])
    of = joints.robot.name if missing.all() else f"{names} of {joints.robot.name}"
    return (
        f"times are chosen, but no acceleration limit is known for {of}: only effort bounds it; "
        "accepted: limits: {acceleration: …}"
    )


def _assumed_jerk_note(chosen_values: ChosenValues) -> str:
    """Text of the assumed jerk limits."""
    motion = chosen_values.sections[0].trajectory
    units = dict(zip(motion.joint_names, motion.joint_units, strict=True))
    names_by_bound: dict[str, list[str]] = {}
    for name, bound in chosen_values.assumed_jerk.items():
        text = chosen_values.scenario.units.text(bound, rate_unit(units[name], 3))
        names_by_bound.setdefault(text, []).append(name)
    bounds = [f"{bound} for {', '.join(names)}" for bound, names in names_by_bound.items()]
    return f"no jerk limit is given, so one is assumed: {'; '.join(bounds)}"


def _limit_text(limit: str, share: float | None) -> str:
    """An active limit, and for how long it is active in a motion with chosen times."""
    if share is None:
        return limit
    return f"{limit} for {100 * share:.0f} % of the time" if share else f"{limit} at its peak"


def _limits_by_interval(chosen_values: ChosenValues) -> dict[tuple[str, str], _Shares]:
    """Active limits by interval, each with its share of the time."""
    limits: defaultdict[tuple[str, str], _Shares] = defaultdict(list)
    for limit in chosen_values.active_limits:
        text = _quantity_text(limit.quantity, chosen_values.scenario)
        if limit.subject:
            text += f" of {limit.subject!r}"
        if limit.quantity == "jerk" and limit.subject in chosen_values.assumed_jerk:
            text += " (assumed)"
        limits[limit.start, limit.end].append((text, limit.share))
    return limits


def _quantity_text(quantity: str, scenario: Scenario) -> str:
    """A limited quantity, or another bound of a speed along a path."""
    if quantity == SpeedBound.PATH_ACCELERATION:
        path = next(path for path in scenario.paths if not path.timed_path.is_wait)
        return f"path.acceleration, {scenario.units.text(path.requested.acceleration, 'm/s²')}"
    return SPEED_BOUND_TEXTS.get(quantity, quantity.replace("_", " "))


def _longest(limits: _Shares) -> str:
    """The limit that is active for the longest time, and the number of other ones."""
    limit, share = max(limits, key=lambda pair: pair[1] or 0.0)
    remaining = f", and by {len(limits) - 1} more" if len(limits) > 1 else ""
    return f"{_limit_text(limit, share)}{remaining}"


def clear_motion_findings(
    clear_motions: Iterable[StoredClearMotion],
    scenario: Scenario,
    joints: ScenarioJoints,
    trajectory: JointTrajectory,
) -> Iterator[Finding]:
    """Report the tries and the minimum clearance of each collision-free motion.

    Args:
        clear_motions: The motions.
        scenario: The scenario, with all times known.
        joints: The joints and their robot.
        trajectory: The planned motion.
    """
    if joints.robot is None:
        return
    motion = Motion(trajectory, joints)
    model = collision_model_of(motion, scenario, joints.robot)
    around = replace(model, pairs=tuple(pair for pair in model.pairs if pair.involves_scene))
    length, _ = scenario.task.units.in_si
    resolution = scenario.scene.collisions.resolution
    for indices, section in clear_motions:
        start, end = (scenario.waypoints[indices[k]] for k in (0, -1))
        name, interval = f"{start.name} to {end.name}", (start.time, end.time)
        tries = "found in 1 try" if section.tries == 1 else f"the fastest of {section.tries} tries"
        extra = ""
        if section.extra_clearance is not None:
            extra_clearance = scenario.units.text(section.extra_clearance * length, "m", ".3g")
            extra = f" with {extra_clearance} of extra clearance"
        fact = highlight = f"{name}: clear motion, {tries}{extra}"
        cut = cut_curve(motion.curve, *interval), resolution, SHOWN_CLEARANCE_PRECISION
        # relative to the surroundings, or of all pairs without any
        least = least_clearance(around, *cut) or least_clearance(model, *cut)
        if least is not None:
            clearance = f"minimum clearance {scenario.units.text(least.distance, 'm', '.3g')}"
            pair = f"{least.second.name}, {least.first.name}"
            fact += f", {clearance} ({pair}) at {least.time:.2f} s"
            highlight = f"{name}:{extra}{',' if extra else ''} {clearance}"
        yield Topic(Group.WAYS, "waypoint", end.name).finding(
            "way",
            fact,
            value=None if least is None else least.distance,
            unit="" if least is None else "m",
            time=None if least is None else least.time,
            interval=interval,
            highlight=highlight,
        )
