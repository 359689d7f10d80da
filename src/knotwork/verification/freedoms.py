"""What poses leave open: how much of it the motion uses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.units import Units
from knotwork.verification.bounds.free_turn import free_angles
from knotwork.verification.finding import Finding
from knotwork.verification.motion import Motion
from knotwork.verification.paths import joined_paths
from knotwork.waypoints import CartesianWaypoint, FloatArray, PoseFreedom

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.robot import Robot

GROUP = "Freedom"
SAMPLES = 400
"""Number of times along a path."""
NOISE = 1e-6
"""An angle or place below this is none [rad or m]."""


class Used(NamedTuple):
    """What a motion uses of what a waypoint or a path leaves open.

    Attributes:
        subject: `"waypoint"` or `"path"`.
        name: Which one.
        time: When it was looked at [s], shape (k,).
        values: Angles and places [rad or m] by name and unit, shape (k,) each.
        bounds: Least and greatest that is allowed of each.
    """

    subject: str
    name: str
    time: FloatArray
    values: dict[tuple[str, str], FloatArray]
    bounds: dict[tuple[str, str], tuple[float, float]]


def uses(motion: Motion, scenario: Scenario, robot: Robot) -> Iterator[Used]:
    """Sample the turns, tilts and places that are free; turns go on along joined paths."""
    waypoints = scenario.waypoints
    on_paths = {i for path in scenario.paths for i in range(path.first, path.last + 1)}
    for i, one in enumerate(waypoints):
        if isinstance(one, CartesianWaypoint) and one.freedom is not None and i not in on_paths:
            asked = ("waypoint", one.name, one.freedom, np.array([one.time]), [one.pose])
            yield from _one_angle(
                [_sampled(motion, robot, *asked)] if _in(motion, asked[3]) else []
            )
    for paths in joined_paths(scenario):
        made = []
        for path in paths:
            t = np.linspace(path.motion.start_time, path.motion.end_time, SAMPLES)
            if path.freedom is not None and _in(motion, t):
                name = f"{waypoints[path.first].name} to {waypoints[path.last].name}"
                poses = [path.motion.pose(time) for time in t.tolist()]
                made.append(_sampled(motion, robot, "path", name, path.freedom, t, poses))
        yield from _one_angle(made)


def _in(motion: Motion, times: FloatArray) -> bool:
    return bool(motion.start_time <= times[0] and times[-1] <= motion.end_time)


def _sampled(
    motion: Motion,
    robot: Robot,
    subject: str,
    name: str,
    freedom: PoseFreedom,
    times: FloatArray,
    asked: Sequence[pin.SE3],
) -> Used:
    found = [robot.forward(q) for q in motion.curve(times)]
    turned = np.array([a.rotation.T @ b.rotation for a, b in zip(asked, found, strict=True)])
    apart = np.array([a.actInv(b.translation) for a, b in zip(asked, found, strict=True)])
    return Used(subject, name, times, _values(freedom, turned, apart), _open(freedom))


def _one_angle(found: list[Used]) -> list[Used]:
    """The turns of joined paths as one angle, as near the middle of its range as it can be."""
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
    """Say which turns, tilts and places were used where they are free, from samples."""
    for subject, name, times, used, bounds in (
        uses(motion, scenario, space.robot) if space.robot else ()
    ):
        texts = [
            f"{key[0]} {_used(values, bounds[key], scenario.units, key[1])}"
            for key, values in used.items()
        ]
        (_, unit), values = max(used.items(), key=lambda one: float(np.ptp(one[1])))
        yield Finding(
            group=GROUP,
            subject=subject,
            name=name,
            quantity="free",
            verdict="information",
            message=f"{name!r} leaves open, and the motion uses: {', '.join(texts)}",
            value=float(np.ptp(values)) if subject == "path" else float(np.abs(values).max()),
            unit=unit,
            interval=(float(times[0]), float(times[-1])),
            proof="sampled",
            brief=f"{name}: {', '.join(texts)}",
        )


def _open(freedom: PoseFreedom) -> dict[tuple[str, str], tuple[float, float]]:
    """What is free, by name and unit, from what to what [rad or m], as the file gives it."""
    spans: dict[tuple[str, str], tuple[float, float]] = {("turn", "rad"): freedom.turn}
    if freedom.torch is not None:
        (low, high), own = freedom.torch.travel, freedom.torch.own
        spans["travel angle", "rad"] = (own + low, own + high)
        (low, high), own = freedom.torch.work, freedom.torch.own_work
        spans["work angle", "rad"] = (own + low, own + high)
    else:
        spans["tilt", "rad"] = (0.0, freedom.tilt)
    spans |= {(axis, "m"): span for axis, span in zip("xyz", freedom.box, strict=True)}
    return {key: (low, high) for key, (low, high) in spans.items() if low < high}


def _values(
    freedom: PoseFreedom, turned: FloatArray, apart: FloatArray
) -> dict[tuple[str, str], FloatArray]:
    """Values of what is free, shape (k,) each, from rotations and places in the pose's axes."""
    whole = np.broadcast_to(np.eye(3), turned.shape)
    turn, travel, work = free_angles(freedom, whole, turned).T
    tilt = np.arctan2(np.hypot(turned[:, 0, 2], turned[:, 1, 2]), turned[:, 2, 2])
    angles = {"turn": turn, "tilt": tilt}
    if freedom.torch is not None:
        own = freedom.torch
        angles |= {"travel angle": travel + own.own, "work angle": work + own.own_work}
    found = angles | dict(zip("xyz", apart.T, strict=True))
    return {key: found[key[0]] for key in _open(freedom)}


def _used(values: FloatArray, bounds: tuple[float, float], units: Units, unit: str) -> str:
    """One value, or the least and the greatest, of those that are allowed."""
    ends = [float(values.min()), float(values.max())]
    shown = [units.text(one if abs(one) > NOISE else 0.0, unit, ".3g") for one in ends]
    allowed = [units.text(one, unit, ".4g") for one in bounds if np.isfinite(one)]
    text = " to ".join(one.split()[0] for one in dict.fromkeys(shown))
    if allowed:
        text += " of " + " to ".join(one.split()[0] for one in allowed)
    return f"{text} {shown[0].split()[1]}"
