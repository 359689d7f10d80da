"""What poses leave open: how much of it the motion uses."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.verification.bounds.free_turn import torch_angles
from knotwork.verification.finding import Finding
from knotwork.verification.motion import Motion
from knotwork.waypoints import CartesianWaypoint, FloatArray, PoseFreedom

GROUP = "Freedom"
SAMPLES = 400
"""Number of times along a path."""


def freedoms_used(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Say which turns, tilts and places were used where they are free, from samples."""
    robot, waypoints = space.robot, scenario.waypoints
    if robot is None:
        return
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
        used = {**_angles(freedom, turned), **_places(freedom, apart)}
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


def _angles(freedom: PoseFreedom, turned: FloatArray) -> dict[tuple[str, str], FloatArray]:
    """Angles that are free, by their names, from those of the pose [rad], shape (k,) each."""
    if freedom.torch is not None:
        names = ("turn", "travel angle", "work angle")
        found = dict(zip(names, torch_angles(freedom.torch, turned), strict=True))
        open_ = dict(
            zip(names, (freedom.turn, freedom.torch.travel, freedom.torch.work), strict=True)
        )
        return {(k, "rad"): np.unwrap(v) for k, v in found.items() if open_[k][0] < open_[k][1]}
    used: dict[tuple[str, str], FloatArray] = {}
    if freedom.turn[0] < freedom.turn[1]:
        turn = np.arctan2(turned[:, 1, 0] - turned[:, 0, 1], turned[:, 0, 0] + turned[:, 1, 1])
        used["turn", "rad"] = np.unwrap(turn)
    if freedom.tilt:
        across = np.hypot(turned[:, 0, 2], turned[:, 1, 2])
        used["tilt", "rad"] = np.arctan2(across, turned[:, 2, 2])
    return used


def _places(freedom: PoseFreedom, apart: FloatArray) -> dict[tuple[str, str], FloatArray]:
    """Places that are free, by their axes, from the pose [m], shape (k,) each."""
    boxes = zip("xyz", freedom.box, apart.T, strict=True)
    return {(axis, "m"): values for axis, (low, high), values in boxes if low < high}


def _span(values: FloatArray, scenario: Scenario, unit: str) -> str:
    """One value, or the least and the greatest."""
    low, high = (
        scenario.units.text(float(one), unit, ".3g") for one in (values.min(), values.max())
    )
    return low if low == high else f"{low.split()[0]} to {high}"
