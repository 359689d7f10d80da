"""Findings on chosen times: duration, lower bound, gap and limiting constraints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from knotwork.joint_quantities import rate_unit
from knotwork.planning.choosing.choice import ChosenTimes
from knotwork.planning.choosing.path_speeds import Bound
from knotwork.scenario.joint_space import JointSpace
from knotwork.verification import Finding
from knotwork.verification.finding import Verdict

GROUP = "Chosen times"


def findings(chosen: ChosenTimes, space: JointSpace) -> Iterator[Finding]:
    """Report the duration, its gap to the lower bound, and the limiting constraints.

    Args:
        chosen: The chosen times.
        space: The joints and their limits.
    """
    yield _of_motion("duration", _duration(chosen), chosen.duration)
    shortest = f"{chosen.lower_bound:.6g} s{_met(chosen)}"
    what = "with these speeds along its paths" if _path_speeds_chosen(chosen) else "for this task"
    message = f"no motion {what} within the limits is shorter than {shortest}"
    yield _of_motion("lower_bound", message, chosen.lower_bound)
    verdict: Verdict = "warning" if chosen.status != "optimal" else "information"
    message = _duration(chosen)
    brief = message.removeprefix("times chosen: ")
    yield replace(_of_motion("chosen_times", message, verdict=verdict), brief=brief)
    unlimited = _unlimited(space)
    if unlimited:
        yield _of_motion("acceleration_limit", unlimited, verdict="warning")
    if chosen.segments and chosen.assumed_jerk:
        yield _of_motion("assumed_jerk", _assumed(chosen))
    times = {waypoint.name: waypoint.time for waypoint in chosen.scenario.waypoints}
    for (start, end), limits in _binding(chosen).items():
        parts = [f"{what} {_how_long(share)}" for what, share in limits]
        yield Finding(
            group=GROUP,
            subject="waypoint",
            name=end,
            quantity="binding_limits",
            verdict="information",
            fact=f"{start} to {end}: {', '.join(parts)}",
            interval=(times[start], times[end]),
            label=_most(limits),
            brief=f"{start} to {end}: bound by {_most(limits)}",
        )


def _of_motion(
    quantity: str,
    message: str,
    seconds: float | None = None,
    verdict: Verdict = "information",
) -> Finding:
    """A finding on the whole motion, with a time if there is one [s]."""
    unit = "s" if seconds is not None else ""
    return Finding(GROUP, "motion", "", quantity, verdict, message, value=seconds, unit=unit)


def _duration(chosen: ChosenTimes) -> str:
    if chosen.status == "stopped":
        what = " with these speeds along its paths" if _path_speeds_chosen(chosen) else ""
        return (
            f"times chosen: {chosen.duration:.6g} s, the best so far when the budget ended: every "
            "limit is kept, but a shorter motion may exist "
            f"(lower bound{what} {chosen.lower_bound:.6g} s)"
        )
    if chosen.status == "resting":
        return (
            f"times chosen: {chosen.duration:.6g} s: every limit is kept, but the arm rests "
            "between waypoints, and a shorter motion may exist "
            f"(lower bound {chosen.lower_bound:.6g} s)"
        )
    if chosen.gap < 1e-6:
        least = "as given, or the minimum"
        return f"times chosen: {chosen.duration:.6g} s in all, {least}{_met(chosen)}"
    return (
        f"times chosen: {chosen.duration:.6g} s, {100 * chosen.gap:.1f} % above the lower bound "
        f"{chosen.lower_bound:.6g} s{_met(chosen)}"
    )


def _met(chosen: ChosenTimes) -> str:
    """Given times at moving frames, in words, on which the lower bound depends."""
    at = {one.name: one.time for one in chosen.scenario.waypoints}
    met = [f"{name!r} met at {at[name]:.6g} s" for name in chosen.met]
    return f" with {', '.join(met)}" if met else ""


def _path_speeds_chosen(chosen: ChosenTimes) -> bool:
    """Whether speeds along paths were chosen, on which the lower bound depends."""
    return chosen.asked.free is not None and bool(chosen.asked.free.path_speed)


def _unlimited(space: JointSpace) -> str:
    """Warning on joints without an acceleration limit; empty if all have one."""
    missing = np.isinf(space.limits["acceleration"])
    if space.robot is None or not missing.any():
        return ""
    names = ", ".join(name for name, one in zip(space.joint_names, missing, strict=True) if one)
    of = space.robot.name if missing.all() else f"{names} of {space.robot.name}"
    return (
        f"times are chosen, but no acceleration limit is known for {of}: only torque bounds it; "
        "accepted: limits: {acceleration: …}"
    )


def _assumed(chosen: ChosenTimes) -> str:
    """The assumed jerk limits, in words."""
    motion = chosen.segments[0].trajectory
    units = dict(zip(motion.joint_names, motion.joint_units, strict=True))
    joints: dict[str, list[str]] = {}
    for name, bound in chosen.assumed_jerk.items():
        text = chosen.scenario.units.text(bound, rate_unit(units[name], 3))
        joints.setdefault(text, []).append(name)
    text = "; ".join(f"{bound} for {', '.join(names)}" for bound, names in joints.items())
    return f"no jerk limit is given, so one is assumed: {text}"


def _how_long(share: float | None) -> str:
    if share is None:
        return "bounds the speed along the path"
    return f"for {100 * share:.0f} % of the time" if share else "at its peak"


def _binding(chosen: ChosenTimes) -> dict[tuple[str, str], list[tuple[str, float | None]]]:
    """Limiting constraints by interval, each with its share of the time."""
    found: dict[tuple[str, str], list[tuple[str, float | None]]] = {}
    text = chosen.scenario.units.text
    for one in chosen.binding:
        what = f"{one.joint} {one.quantity}" if one.joint else one.quantity
        if one.quantity == "jerk" and one.joint in chosen.assumed_jerk:
            what += " (assumed)"
        if one.quantity == Bound.RAMPS:
            asked = chosen.scenario.paths[0].asked
            what += f" at path.acceleration, {text(asked.acceleration, 'm/s²')},"
        found.setdefault((one.start, one.end), []).append((what, one.share))
    return found


def _most(limits: list[tuple[str, float | None]]) -> str:
    """The constraint that limits for most of the time, and the number of others."""
    what, share = max(limits, key=lambda one: one[1] or 0.0)
    others = f", and by {len(limits) - 1} more" if len(limits) > 1 else ""
    return f"{what} {_how_long(share).removeprefix('for ')}{others}"
