"""`judge`: what is wrong with a motion, from docs/method.md and docs/tool_paths.md.

Joint quantities are polynomials: their extrema are exact. What the tool does is sampled densely, so
that every wrong that is found is one; what lies between two samples is not.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from judge.along import path_wrongs
from judge.arm import mass_of
from judge.bodies import collision_wrongs
from judge.motion import Motion
from judge.placing import turn_between
from judge.task import Task

SLACK = 1e-9
DERIVATIVES = ("position", "velocity", "acceleration", "jerk")
# What always counts as a jump, and changes that are faster than any drive.
JUMPS = (1e-9, 1e-7, 1e-5)
FASTEST = (1e3, 1e5, 1e6)
SAMPLES = 1000


class Wrong(NamedTuple):
    """What is wrong, where, by how much, and what is allowed."""

    kind: str
    where: str
    value: float
    allowed: float


def beyond(value: float, allowed: float) -> bool:
    return not value <= allowed + SLACK * max(1.0, abs(allowed))


def judge(
    task: Task, motion: Motion, *, collisions: bool = True, samples: int = SAMPLES
) -> list[Wrong]:
    """Everything that is wrong.

    Args:
        task: The task that the motion must meet.
        motion: Its joints in any order.
        collisions: Whether to look for these; they take the longest.
        samples: Of the whole motion, for limits that are sampled.
    """
    order = [motion.names.index(name) for name in task.names]
    motion = Motion(task.names, motion.x, motion.c[:, :, order])
    wrongs = list(_span(task, motion))
    if wrongs:
        return wrongs
    wrongs += _waypoints(task, motion)
    wrongs += _continuity(task, motion)
    wrongs += _waits(task, motion)
    wrongs += _joint_limits(task, motion)
    if task.arm is not None:
        wrongs += _sampled_limits(task, motion, samples)
        wrongs += (Wrong(*one) for one in path_wrongs(task, motion, samples))
        if collisions:
            wrongs += (Wrong(*one) for one in collision_wrongs(task, motion))
    return wrongs


def _span(task: Task, motion: Motion) -> Iterator[Wrong]:
    ends = (task.waypoints[0].time, motion.x[0]), (task.waypoints[-1].time, motion.x[-1])
    for which, (given, found) in zip(("start", "end"), ends, strict=True):
        if beyond(abs(found - given), SLACK * abs(given)):
            yield Wrong("time", which, float(found), given)


def _waypoints(task: Task, motion: Motion) -> Iterator[Wrong]:
    position, velocity = (task.joint_tolerance(f"joint_{n}") for n in DERIVATIVES[:2])
    for one in task.waypoints:
        t = np.array([min(max(one.time, motion.x[0]), motion.x[-1])])
        q, v = motion(t), motion(t, 1)
        if one.joints is not None and one.velocity is not None:
            for kind, off, allowed in (
                ("pose", np.abs(q[0] - one.joints), position),
                ("velocity", np.abs(v[0] - one.velocity), velocity),
            ):
                i = int((off / allowed).argmax())
                if off[i] > allowed[i]:
                    yield Wrong(kind, one.name, float(off[i]), float(allowed[i]))
            continue
        pose, twist = task.arm.poses(q, t)[0], task.arm.velocities(q, v, t=t)[0]
        turn, spin = pose.rotation, twist[3:] - one.twist[3:]
        if one.free:  # as far as its axis says
            turn = pin.Quaternion.FromTwoVectors(one.pose.rotation[:, 2], turn[:, 2]).matrix()
            turn = turn @ one.pose.rotation
            spin = spin - (spin @ turn[:, 2]) * turn[:, 2]
        for kind, name, off in (
            ("pose", "position", np.linalg.norm(pose.translation - one.pose.translation)),
            ("pose", "orientation", turn_between(one.pose.rotation, turn)),
            ("velocity", "linear_velocity", np.linalg.norm(twist[:3] - one.twist[:3])),
            ("velocity", "angular_velocity", np.linalg.norm(spin)),
        ):
            if off > task.tolerance(name):
                yield Wrong(kind, f"{one.name}, {name}", float(off), task.tolerance(name))
    if task.end_acceleration is not None:
        allowed = task.joint_tolerance("joint_acceleration")
        for t, given in zip(motion.x[[0, -1]], task.end_acceleration, strict=True):
            off = np.abs(motion(t, 2) - given)
            if (off > allowed).any():
                yield Wrong("end acceleration", f"{t:g} s", float(off.max()), float(allowed.min()))


def _continuity(task: Task, motion: Motion) -> Iterator[Wrong]:
    for order in range(int(task.data.get("continuity", 2)) + 1):
        sizes = motion.jumps(order)
        if sizes.size and sizes.max() > JUMPS[order]:
            yield Wrong("jump", DERIVATIVES[order], float(sizes.max()), JUMPS[order])
        low, high = motion.critical(order + 1, motion.x[0], motion.x[-1])
        peak = float(np.maximum(-low, high).max())
        if peak > FASTEST[order]:
            yield Wrong("jump", f"{DERIVATIVES[order]} changes", peak, FASTEST[order])


def _waits(task: Task, motion: Motion) -> Iterator[Wrong]:
    allowed = task.joint_tolerance("joint_position")
    for name, start, end in task.waits:
        low, high = motion.critical(0, start, end)
        begin = motion(start)
        moved = np.maximum(high - begin, begin - low)
        if (moved > allowed).any():
            yield Wrong("hold", name, float(moved.max()), float(allowed.min()))


def _joint_limits(task: Task, motion: Motion) -> Iterator[Wrong]:
    for order, kind in enumerate(DERIVATIVES):
        low, high = motion.critical(order, motion.x[0], motion.x[-1])
        for i, name in enumerate(task.names):
            given = task.limits[kind][i]
            lower, upper = given if order == 0 else (-given, given)
            if beyond(high[i], upper):
                yield Wrong(f"{kind} limit", name, float(high[i]), float(upper))
            if beyond(-low[i], -lower):
                yield Wrong(f"{kind} limit", name, float(low[i]), float(lower))


def _efforts(task: Task, t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Efforts, with what is held at each time."""
    efforts = task.arm.efforts(q, v, a)
    times = {waypoint.name: waypoint.time for waypoint in task.waypoints}
    for one in ((task.data.get("tool") or {}).get("holds") or {}).values():
        if one.get("mass"):
            there = (t >= times[one["from"]]) & (t <= times[one["to"]])
            body = mass_of(one, task.length)
            state = q[there], v[there], a[there]
            efforts[there] += task.arm.efforts(*state, body) - task.arm.efforts(*state)
    return efforts


def _sampled_limits(task: Task, motion: Motion, samples: int) -> Iterator[Wrong]:
    arm, limited = task.arm, np.isfinite(task.limits["effort"])
    t = motion.dense(samples)
    q, v, a = (motion(t, order) for order in range(3))
    rows: list[tuple[str, str, float, float]] = []
    if limited.any():
        x = motion.x
        before = motion(x, 2, side="left")  # the acceleration from the other side of a break
        states = (t, q, v, a), (x, motion(x), motion(x, 1), before)
        felt = np.max([np.abs(_efforts(task, *state)).max(axis=0) for state in states], axis=0)
        rows += [
            ("effort limit", name, felt[i], task.limits["effort"][i])
            for i, name in enumerate(task.names)
            if limited[i]
        ]
    if task.tool_speed is not None:
        speed = np.linalg.norm(arm.velocities(q, v)[:, :3], axis=1).max()
        rows.append(("tool speed", "tool", speed, task.tool_speed))
    if task.tool_acceleration is not None:
        rows.append(
            ("tool acceleration", "tool", arm.accelerations(q, v, a).max(), task.tool_acceleration)
        )
    for link, limit in task.frame_speed:
        speed = np.linalg.norm(arm.velocities(q, v, link)[:, :3], axis=1).max()
        rows.append(("frame speed", link, speed, limit))
    for kind, where, value, limit in rows:
        if beyond(float(value), limit):
            yield Wrong(kind, where, float(value), float(limit))
    if task.singular_value is not None:
        least = float(arm.singular_values(q).min())
        if beyond(-least, -task.singular_value):
            yield Wrong("singular value", "tool", least, task.singular_value)
