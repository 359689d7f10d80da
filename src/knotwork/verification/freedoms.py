"""Use of the freedoms of poses by the motion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from knotwork.scenario import Scenario, ScenarioPath
from knotwork.scenario.joint_space import JointSpace
from knotwork.units import Units
from knotwork.verification.bounds.free_turn import free_angles, open_ranges
from knotwork.verification.finding import Finding
from knotwork.verification.motion import Motion
from knotwork.verification.paths import joined_paths
from knotwork.waypoints import CartesianWaypoint, FloatArray, PoseFreedom

if TYPE_CHECKING:
    from knotwork.robot import Robot

GROUP = "Freedom"
SAMPLES = 400
"""Number of times along a path."""
SINGULAR, SPARED = 0.01, 0.02
"""Relative singular value that counts as zero; minimum relative gain that is reported."""
NOISE = 1e-6
"""Smaller angles and distances count as zero [rad or m]."""


class Used(NamedTuple):
    """A motion's use of the freedom of a waypoint or a path.

    Attributes:
        subject: `"waypoint"` or `"path"`.
        name: Name of the waypoint or path.
        time: Sample times [s], shape (k,).
        values: Angles and positions [rad or m] by name and unit, shape (k,) each.
        bounds: Minimum and maximum allowed of each.
        path: The path, or `None` for a waypoint.
    """

    subject: str
    name: str
    time: FloatArray
    values: dict[tuple[str, str], FloatArray]
    bounds: dict[tuple[str, str], tuple[float, float]]
    path: ScenarioPath | None = None


def uses(motion: Motion, scenario: Scenario, robot: Robot) -> Iterator[Used]:
    """Sample free turns, tilts and positions; turns are continuous along joined paths."""
    waypoints = scenario.waypoints
    on_paths = {i for path in scenario.paths for i in range(path.first, path.last + 1)}
    for paths in joined_paths(scenario):
        made = []
        for path in paths:
            t = np.linspace(path.motion.start_time, path.motion.end_time, SAMPLES)
            if path.freedom is not None and _in(motion, t):
                name = f"{waypoints[path.first].name} to {waypoints[path.last].name}"
                poses = path.motion.state(t)[:2]
                seen = [robot.forward(q) for q in motion.curve(t)]
                used = _sampled("path", name, path.freedom, t, poses, seen)
                made.append(used._replace(path=path))
        yield from _one_angle(made)
    for i, one in enumerate(waypoints):
        if isinstance(one, CartesianWaypoint) and one.freedom is not None and i not in on_paths:
            t, pose = np.array([one.time]), (one.position[None], one.rotation[None])
            if _in(motion, t):
                seen = [robot.tool_seen(motion.curve(one.time), standing=one.standing)]
                yield from _one_angle([_sampled("waypoint", one.name, one.freedom, t, pose, seen)])


def _in(motion: Motion, times: FloatArray) -> bool:
    return bool(motion.start_time <= times[0] and times[-1] <= motion.end_time)


def _sampled(
    subject: str,
    name: str,
    freedom: PoseFreedom,
    times: FloatArray,
    asked: tuple[FloatArray, FloatArray],
    found: list[Any],
) -> Used:
    place, back = asked[0], asked[1].transpose(0, 2, 1)
    turned = back @ np.array([pose.rotation for pose in found])
    off = np.array([pose.translation for pose in found]) - place
    apart = (back @ off[:, :, None])[:, :, 0]
    return Used(subject, name, times, _values(freedom, turned, apart), open_ranges(freedom))


def _one_angle(found: list[Used]) -> list[Used]:
    """Make the turn continuous along joined paths, as near the middle of its range as possible."""
    key = ("turn", "rad")
    if not found or key not in found[0].values:
        return found
    turn = np.unwrap(np.concatenate([one.values[key] for one in found]))
    middle = np.mean(found[0].bounds[key]) if np.isfinite(found[0].bounds[key]).all() else turn[0]
    turn -= 2.0 * np.pi * np.rint((0.5 * (turn.min() + turn.max()) - middle) / (2.0 * np.pi))
    parts = np.split(turn, np.cumsum([len(one.time) for one in found])[:-1])
    return [
        one._replace(values=one.values | {key: part})
        for one, part in zip(found, parts, strict=True)
    ]


def freedoms_used(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Report the use of free turns, tilts and positions, from samples."""
    robot = space.robot
    if robot is None:
        return
    for one in uses(motion, scenario, robot):
        subject, name, times, used, bounds, path = one
        texts = [
            f"{key[0]} {_used(values, bounds[key], scenario.units, key[1])}"
            for key, values in used.items()
        ]
        text = ", ".join(texts)
        if path is not None:
            text += f"; {_gained(motion, path, times, robot, scenario.units)}"
        (_, unit), values = max(used.items(), key=lambda one: float(np.ptp(one[1])))
        yield Finding(
            group=GROUP,
            subject=subject,
            name=name,
            quantity="free",
            verdict="information",
            message=f"{name!r} leaves open, and the motion uses: {text}",
            value=float(np.ptp(values)) if subject == "path" else float(np.abs(values).max()),
            unit=unit,
            interval=(float(times[0]), float(times[-1])),
            proof="sampled",
            brief=f"{name}: {text}",
        )
    for path in scenario.paths if robot.external_axes else ():
        yield from _along_with(motion, path, scenario, robot)


def _along_with(
    motion: Motion, path: ScenarioPath, scenario: Scenario, robot: Robot
) -> Iterator[Finding]:
    """Report the motion of rails and tables along a path, and of the arm."""
    times = np.linspace(path.motion.start_time, path.motion.end_time, SAMPLES)
    if not _in(motion, times):
        return
    begin, end = (scenario.waypoints[i].name for i in (path.first, path.last))
    moved = np.abs(np.diff(motion.curve(times), axis=0)).sum(axis=0)
    texts = {
        name: f"{name} {scenario.units.text(one if one > NOISE else 0.0, unit, '.3g')}"
        for name, unit, one in zip(robot.joint_names, robot.joint_units, moved, strict=True)
    }
    axes = [name for name in robot.joint_names if name in robot.external_axes]
    arm = [i for i, name in enumerate(robot.joint_names) if name not in axes]
    if not axes or not arm:
        return
    most = robot.joint_names[max(arm, key=lambda i: float(moved[i]))]
    text = f"{', '.join(texts[name] for name in axes)}; of the arm at most {texts[most]}"
    yield Finding(
        group=GROUP,
        subject="path",
        name=f"{begin} to {end}",
        quantity="external_axes",
        verdict="information",
        message=f"from {begin!r} to {end!r} joints move by: {text}",
        value=float(moved[robot.joint_names.index(axes[0])]),
        unit=robot.joint_units[robot.joint_names.index(axes[0])],
        interval=(float(times[0]), float(times[-1])),
        proof="sampled",
        brief=f"{begin} to {end}: {text}",
    )


def _gained(
    motion: Motion, path: ScenarioPath, times: FloatArray, robot: Robot, units: Units
) -> str:
    """Text of the joint that moves less than without the freedom.

    The estimate uses the joint velocities nearest to the motion's with which the tool would rotate
    like its path.
    """
    from knotwork.robot.joint_axes import joint_axes

    q, v = motion.curve(times), motion.curve(times, 1)
    J = joint_axes(robot).place(q)[2].transpose(2, 0, 1)
    missing = path.motion.state(times)[2][:, 3:] - np.einsum("kij,kj->ki", J[:, 3:], v)
    change = np.linalg.pinv(J, rcond=SINGULAR)[:, :, 3:] @ missing[:, :, None]
    own, fixed = (np.trapezoid(np.abs(one), times, axis=0) for one in (v, v + change[:, :, 0]))
    j = int((fixed - own).argmax())
    if fixed[j] - own[j] < SPARED * fixed[j] + NOISE:
        return "no joint moves less for it"
    unit = robot.joint_units[j]
    moved = units.text(float(own[j]) if own[j] > NOISE else 0.0, unit, ".3g")
    name, instead = robot.joint_names[j], units.text(float(fixed[j]), unit, ".2g")
    return f"{name} moves by {moved}, with nothing free by about {instead}"


def _values(
    freedom: PoseFreedom, turned: FloatArray, apart: FloatArray
) -> dict[tuple[str, str], FloatArray]:
    """Free values, shape (k,) each, from rotations and positions in the pose's axes."""
    whole = np.broadcast_to(np.eye(3), turned.shape)
    turn, travel, work = free_angles(freedom, whole, turned).T
    tilt = np.arctan2(np.hypot(turned[:, 0, 2], turned[:, 1, 2]), turned[:, 2, 2])
    angles = {"turn": turn, "tilt": tilt}
    if freedom.torch is not None:
        own = freedom.torch
        angles |= {"travel angle": travel + own.own, "work angle": work + own.own_work}
    found = angles | dict(zip("xyz", apart.T, strict=True))
    return {key: found[key[0]] for key in open_ranges(freedom)}


def _used(values: FloatArray, bounds: tuple[float, float], units: Units, unit: str) -> str:
    """Text of one value, or of the minimum and maximum, with the allowed range."""
    ends = [float(values.min()), float(values.max())]
    shown = [units.text(one if abs(one) > NOISE else 0.0, unit, ".3g") for one in ends]
    allowed = [units.text(one, unit, ".4g") for one in bounds if np.isfinite(one)]
    text = " to ".join(one.split()[0] for one in dict.fromkeys(shown))
    if allowed:
        text += " of " + " to ".join(one.split()[0] for one in allowed)
    return f"{text} {shown[0].split()[1]}"
