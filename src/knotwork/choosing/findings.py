"""What the report says of chosen times: duration, lower bound, gap, and what binds where."""

from __future__ import annotations

from collections.abc import Iterator

from knotwork.choosing.choice import ChosenTimes
from knotwork.joint_quantities import rate_unit
from knotwork.verification import Finding
from knotwork.verification.finding import Verdict

GROUP = "Chosen times"


def findings(chosen: ChosenTimes) -> Iterator[Finding]:
    """Say how long the chosen motion is, how far above the lower bound, and what binds where."""
    yield _of_motion("duration", _duration(chosen), chosen.duration)
    shortest = f"{chosen.lower_bound:.6g} s"
    message = f"no motion that does this within the limits is shorter than {shortest}"
    yield _of_motion("lower_bound", message, chosen.lower_bound)
    verdict: Verdict = "warning" if chosen.status == "stopped" else "information"
    yield _of_motion("chosen_times", _duration(chosen), verdict=verdict)
    if chosen.runs and chosen.assumed_jerk:
        yield _of_motion("assumed_jerk", _assumed(chosen))
    times = {waypoint.name: waypoint.time for waypoint in chosen.scenario.waypoints}
    for (start, end), said in _binding(chosen).items():
        yield Finding(
            group=GROUP,
            subject="waypoint",
            name=end,
            quantity="binding_limits",
            verdict="information",
            message=f"{start} to {end}: {said}",
            interval=(times[start], times[end]),
        )


def _of_motion(
    quantity: str,
    message: str,
    seconds: float | None = None,
    verdict: Verdict = "information",
) -> Finding:
    """Say something of the motion as a whole, with a time if there is one [s]."""
    unit = "s" if seconds is not None else ""
    return Finding(GROUP, "motion", "", quantity, verdict, message, value=seconds, unit=unit)


def _duration(chosen: ChosenTimes) -> str:
    if chosen.status == "stopped":
        return (
            f"times chosen: {chosen.duration:.6g} s, the best so far when the budget ended: every "
            "limit is kept, but a shorter motion may exist "
            f"(lower bound {chosen.lower_bound:.6g} s)"
        )
    if chosen.gap < 1e-6:
        return f"times chosen: {chosen.duration:.6g} s in all, which was given or can't be less"
    return (
        f"times chosen: {chosen.duration:.6g} s, {100 * chosen.gap:.1f} % above the lower bound "
        f"{chosen.lower_bound:.6g} s"
    )


def _assumed(chosen: ChosenTimes) -> str:
    """The bounds of jerk that nobody gave, in words."""
    motion = chosen.runs[0].trajectory
    units = dict(zip(motion.joint_names, motion.joint_units, strict=True))
    joints: dict[str, list[str]] = {}
    for name, bound in chosen.assumed_jerk.items():
        joints.setdefault(f"{bound:.6g} {rate_unit(units[name], 3)}", []).append(name)
    said = "; ".join(f"{bound} for {', '.join(names)}" for bound, names in joints.items())
    return f"no limit of jerk is given, so one is assumed: {said}"


def _binding(chosen: ChosenTimes) -> dict[tuple[str, str], str]:
    """Limits that bind, by interval, in words."""
    parts: dict[tuple[str, str], list[str]] = {}
    for one in chosen.binding:
        what = f"{one.joint} {one.quantity}" if one.joint else one.quantity
        if one.quantity == "jerk" and one.joint in chosen.assumed_jerk:
            what += " (assumed)"
        parts.setdefault((one.start, one.end), []).append(
            f"{what} for {100 * one.share:.0f} % of the time"
        )
    return {ends: ", ".join(said) for ends, said in parts.items()}
