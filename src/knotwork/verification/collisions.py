"""Collisions of robot, tool, held objects and their surroundings with one another."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.errors.plain_text import waypoint_text
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.trajectory import JointTrajectory
from knotwork.verification.finding import Finding
from knotwork.verification.limits import absurdity
from knotwork.verification.motion import AT_WAYPOINT, Motion, between
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.scene.collision_model import CollisionModel
    from knotwork.verification.bounds.clearance import Clearance

GROUP = "Collisions"
QUANTITY = "clearance"

MOST_CONTACTS = 5
"""Maximum number of contacts of a pair that are reported with their times."""

MARGIN_PRECISION = 2e-4
"""Precision of the minimum clearance of a motion, by which motions are ranked [m]."""


def collisions(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Prove over all time that all pairs of bodies keep their margins."""
    robot, scene = space.robot, scenario.scene
    if robot is None or not (scene.rules.itself or scene.asks()):
        return
    if absurd := absurdity(motion.curve, space):
        yield motion_finding("clearances", f"collisions are not examined: {absurd}", "failed")
        return
    from knotwork.verification.bounds.clearance import clearances

    model = motion_model(motion, scenario, robot)
    yield from _missing(model, scenario, robot)
    found = clearances(model, motion.curve, scene.rules.resolution)
    nearest = _nearest_of_each(found)
    for one in sorted(found, key=lambda one: one.distance - one.margin):
        yield _finding(one, scenario, robot, detail=one not in nearest)


def nearest_to(
    trajectory: JointTrajectory, scenario: Scenario, space: JointSpace, name: str
) -> Finding | None:
    """Finding of the nearest pair with another robot of the scene; `None` if no pair is checked."""
    robot, motion = space.robot, Motion(trajectory, space)
    if robot is None:
        return None
    if absurd := absurdity(motion.curve, space):
        return motion_finding("clearances", f"collisions are not examined: {absurd}", "failed")
    from knotwork.verification.bounds.clearance import least_clearance

    model = motion_model(motion, scenario, robot)
    other = [body.name.startswith(f"{name}/") for body in model.bodies]
    pairs = tuple(pair for pair in model.pairs if other[pair.first] or other[pair.second])
    model, resolution = replace(model, pairs=pairs), scenario.scene.rules.resolution
    found = least_clearance(model, motion.curve, resolution, MARGIN_PRECISION)
    return None if found is None else _finding(found, scenario, robot, detail=False)


def motion_model(motion: Motion, scenario: Scenario, robot: Robot) -> CollisionModel:
    """The collision model of a scenario, with held objects at the motion's grasps and releases.

    Raises:
        DocumentError: A mesh is wrong, or a name in the scenario is unknown.
    """
    from knotwork.scene.building import collision_model

    times = np.clip(scenario.times, motion.start_time, motion.end_time).tolist()
    held = bool(scenario.scene.held)
    stops = zip(times, scenario.waypoints, strict=True) if held else ()
    poses = [robot.tool_seen(motion.curve(t), standing=one.standing) for t, one in stops]
    return collision_model(scenario, robot, times, poses)


def _missing(model: CollisionModel, scenario: Scenario, robot: Robot) -> Iterator[Finding]:
    """Report bodies without shapes, pairs that are not checked, and plausible mistakes."""
    missing = [f"{one}; it is not checked for collisions" for one in model.missing]
    notes = [*(("warning", one) for one in missing), *model.notes]
    asks = scenario.scene.asks()
    if asks and not any(body.kind == "link" for body in model.bodies):
        notes.append(
            (
                "warning",
                f"the links of robot {robot.name!r} have no collision shapes: only its tool and "
                "what it holds are checked for collisions",
            )
        )
    elif model.bare:
        notes.append(("warning" if asks else "information", model.bare_links_note))
    for verdict, message in notes:
        yield motion_finding("collision_shapes", message, verdict)
    for message in model.ignored_pairs_notes:
        yield motion_finding("pairs_not_checked", message)


def motion_finding(quantity: str, message: str, verdict: Any = "information") -> Finding:
    """Make a finding about the collisions of a whole motion, without a value."""
    return Finding(GROUP, "motion", "", quantity, verdict, message)


def _nearest_of_each(found: Sequence[Clearance]) -> list[Clearance]:
    """The nearest pair of each object, and of the robot with itself, for tables."""
    nearest: dict[str | None, Clearance] = {}
    for one in found:
        key = one.first.name if one.around else None
        if key not in nearest or one.distance < nearest[key].distance:
            nearest[key] = one
    return list(nearest.values())


def _finding(found: Clearance, scenario: Scenario, robot: Robot, *, detail: bool) -> Finding:
    clear = found.verdict == "clear"
    world = robot.base_placement.inverse()
    points = [world.act(point) for point in found.nearest.points]
    return Finding(
        group=GROUP,
        subject="pair",
        name=f"{found.second.name}, {found.first.name}",
        quantity=QUANTITY,
        verdict="met" if clear else "failed",
        message=_message(found, points, scenario),
        value=found.distance,
        limit=found.margin,
        margin=(found.bound if clear else found.distance) - found.margin,
        unit="m",
        time=found.time,
        interval=found.interval,
        intervals=found.contacts,
        proof="bounded",
        excess=max(found.distance - found.bound, 0.0) if np.isfinite(found.bound) else 0.0,
        points=tuple(tuple(float(x) for x in point) for point in points),
        label=("undecided: " if found.verdict == "undecided" else "") + _pair_text(found, scenario),
        detail=detail and clear,
        around=found.around,
        bodies=(found.second.name, found.first.name),
    ).with_remedy(_why_no_detour(found, scenario))


def _why_no_detour(found: Clearance, scenario: Scenario) -> str:
    """Text of why no detour helps: the object may appear later, or a waypoint itself collides."""
    if found.verdict != "collides" or found.interval is None:
        return ""
    held = {one.name: one for one in scenario.scene.held}
    for body, other in ((found.first, found.second), (found.second, found.first)):
        waits = body.name in held and held[body.name].appears is None and np.isinf(body.start)
        if waits and body.kind == "object" and other.name in held:
            return f"{body.name} is there from the start; appears: NAME has it come at a waypoint"
    spans = found.contacts or (found.interval,)
    inside = [
        waypoint_text(waypoint.name)
        for waypoint in scenario.waypoints
        if any(a - AT_WAYPOINT <= waypoint.time <= b + AT_WAYPOINT for a, b in spans)
    ]
    several = "themselves collide" if len(inside) > 1 else "itself collides"
    return f"{', '.join(inside)} {several}" if inside else ""


def _message(found: Clearance, points: Sequence[FloatArray], scenario: Scenario) -> str:
    """Message: distance, time and place."""
    scale, unit = scenario.shown_length
    second, first = (body.name for body in (found.second, found.first))
    at = f"at {found.time:.3f} s"
    keep = f", required {scale * found.margin:.4g} {unit}" if found.margin else ""
    if found.verdict == "clear":
        return (
            f"{second} comes within {scale * found.distance:.4g} {unit} of {first} {at}{keep}; "
            f"never nearer than {scale * found.bound:.4g} {unit}"
        )
    start, end = found.interval or (found.time, found.time)
    where = f"{at}, {between(scenario, found.time)}{keep}"
    if found.verdict == "undecided":
        return (
            f"it is not decided whether {second} comes too near to {first}: "
            f"{scale * found.distance:.4g} {unit} apart {where}, from {start:.3f} s to "
            f"{end:.3f} s within {scale * scenario.scene.rules.resolution:.3g} {unit}, the "
            "resolution"
        )
    both = " and ".join(_shown(scale * point) for point in points)
    return (
        f"{_pair_text(found, scenario)} {where} (too near {_when(found)}; nearest points {both} "
        f"{unit})"
    )


def _pair_text(found: Clearance, scenario: Scenario) -> str:
    """Text of the distance or the penetration of two bodies."""
    scale, unit = scenario.shown_length
    how = f"comes within {scale * found.distance:.4g} {unit} of"
    if found.distance <= 0:
        how = f"is {-scale * found.distance:.4g} {unit} deep in"
    return f"{found.second.name} {how} {found.first.name}"


def _when(found: Clearance) -> str:
    """Text of the contact intervals."""
    times = [f"from {start:.3f} s to {end:.3f} s" for start, end in found.contacts]
    if len(times) > MOST_CONTACTS:
        more = len(times) - MOST_CONTACTS
        times = [*times[:MOST_CONTACTS], f"{more} more {'times' if more > 1 else 'time'}"]
    return " and ".join([", ".join(times[:-1]), times[-1]] if len(times) > 1 else times)


def _shown(vector: FloatArray) -> str:
    """Text of a vector."""
    return "[" + ", ".join(f"{value:.4g}" for value in np.round(vector, 4) + 0.0) + "]"


def failed_pairs(findings: Iterable[Finding]) -> list[Finding]:
    """Findings of pairs that collide or are undecided."""
    return [
        found
        for found in findings
        if found.group == GROUP and found.quantity == QUANTITY and not found.ok
    ]
