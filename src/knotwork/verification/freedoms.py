"""What poses leave open: how much of it the motion uses."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.verification.bounds.free_turn import torch_angles
from knotwork.verification.finding import Finding
from knotwork.verification.motion import Motion
from knotwork.waypoints import CartesianWaypoint, FloatArray, PoseFreedom

if TYPE_CHECKING:
    from knotwork.robot import Robot

GROUP = "Freedom"
SAMPLES = 400
"""Number of times along a path."""


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
    """Sample the turns, tilts and places that are free."""
    waypoints = scenario.waypoints
    on_paths = {i for path in scenario.paths for i in range(path.first, path.last + 1)}
    places = (
        ("waypoint", one.name, one.freedom, np.array([one.time]), [one.pose])
        for i, one in enumerate(waypoints)
        if isinstance(one, CartesianWaypoint) and i not in on_paths
    )
    paths = (
        (
            "path",
            f"{waypoints[one.first].name} to {waypoints[one.last].name}",
            one.freedom,
            t,
            poses,
        )
        for one in scenario.paths
        if one.freedom is not None
        for t in [np.linspace(one.motion.start_time, one.motion.end_time, SAMPLES)]
        for poses in [[one.motion.pose(time) for time in t.tolist()]]
    )
    for subject, name, freedom, times, asked in chain(places, paths):
        inside = (motion.start_time <= times) & (times <= motion.end_time)
        if freedom is None or not inside.all():
            continue
        found = [robot.forward(q) for q in motion.curve(times)]
        turned = np.array([a.rotation.T @ b.rotation for a, b in zip(asked, found, strict=True)])
        apart = np.array([a.actInv(b.translation) for a, b in zip(asked, found, strict=True)])
        yield Used(subject, name, times, _values(freedom, turned, apart), _open(freedom))


def freedoms_used(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Say which turns, tilts and places were used where they are free, from samples."""
    for subject, name, times, used, _ in uses(motion, scenario, space.robot) if space.robot else ():
        texts = [f"{what} {_span(values, scenario, unit)}" for (what, unit), values in used.items()]
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
    """What is free, by name and unit, from what to what [rad or m]."""
    spans: dict[tuple[str, str], tuple[float, float]] = {("turn", "rad"): freedom.turn}
    if freedom.torch is not None:
        spans["travel angle", "rad"] = freedom.torch.travel
        spans["work angle", "rad"] = freedom.torch.work
    else:
        spans["tilt", "rad"] = (0.0, freedom.tilt)
    spans |= {(axis, "m"): span for axis, span in zip("xyz", freedom.box, strict=True)}
    return {key: (low, high) for key, (low, high) in spans.items() if low < high}


def _values(
    freedom: PoseFreedom, turned: FloatArray, apart: FloatArray
) -> dict[tuple[str, str], FloatArray]:
    """Values of what is free, shape (k,) each, from rotations and places in the pose's axes."""
    if freedom.torch is not None:
        names = ("turn", "travel angle", "work angle")
        angles = dict(zip(names, torch_angles(freedom.torch, turned), strict=True))
    else:
        turn = np.arctan2(turned[:, 1, 0] - turned[:, 0, 1], turned[:, 0, 0] + turned[:, 1, 1])
        across = np.hypot(turned[:, 0, 2], turned[:, 1, 2])
        angles = {"turn": turn, "tilt": np.arctan2(across, turned[:, 2, 2])}
    found = angles | dict(zip("xyz", apart.T, strict=True))
    return {
        (name, unit): np.unwrap(found[name]) if unit == "rad" else found[name]
        for name, unit in _open(freedom)
    }


def _span(values: FloatArray, scenario: Scenario, unit: str) -> str:
    """One value, or the least and the greatest."""
    low, high = (
        scenario.units.text(float(one), unit, ".3g") for one in (values.min(), values.max())
    )
    return low if low == high else f"{low.split()[0]} to {high}"
