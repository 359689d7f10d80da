"""Tool paths: how far the tool is from its path, how it goes along it, and how it is turned."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from judge.curves import ToolPath
from judge.motion import Motion
from judge.placing import turn_between
from judge.task import Task

SAMPLES = 1500
STEPS = 4000
SLACK = 1e-9
STEP = 1e-5
Row = tuple[str, str, float, float]


def tracked(path: ToolPath, points: np.ndarray, room: float) -> np.ndarray:
    """Arc length of the path's point nearest to each point, going on from that of the one before.

    So whole turns count, and a path that comes near itself is not mistaken for where it goes on.

    Args:
        path: From where it begins, s = 0.
        points: Places of the tool, close to one another, shape (k, 3).
        room: How far from the path the tool may be [m]: so far it may be ahead or behind.
    """
    s = np.linspace(0.0, path.length, STEPS + 1)
    places = path.at(s)[0]
    step = path.length / STEPS
    moved = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    found, at = np.empty(len(points)), 0
    for k, point in enumerate(points):
        reach = int(np.ceil((2.0 * moved[k] + 0.25 * room) / step)) + 2
        low, high = max(at - reach, 0), min(at + reach, STEPS) + 1
        at = low + int(np.linalg.norm(places[low:high] - point, axis=1).argmin())
        found[k] = s[at]
    # Newton's method from there: the way to the path is square to it.
    for _ in range(4):
        P, T, bent = path.at(found)
        way = points - P
        slope = np.minimum((way * bent).sum(axis=1) - 1.0, -0.5)
        change = -(way * T).sum(axis=1) / slope
        found = np.clip(found + np.clip(change, -step, step), 0.0, path.length)
    return found


def path_wrongs(task: Task, motion: Motion, samples: int = SAMPLES) -> Iterator[Row]:
    for path in task.paths:
        yield from _path(task, motion, path, samples)


def _times(path: ToolPath, samples: int) -> np.ndarray:
    """Dense all along, and in each ramp and window of full speed."""
    parts = [np.linspace(path.stretches[0].start, path.stretches[-1].end, samples)]
    for one in path.stretches:
        for low, high in ((one.start, one.full[0]), one.full, (one.full[1], one.end)):
            parts.append(np.linspace(low, max(low, high), samples // 10))
    return np.unique(np.concatenate(parts))


def _path(task: Task, motion: Motion, path: ToolPath, samples: int) -> Iterator[Row]:
    arm = task.arm
    name = f"{path.stretches[0].names[0]} to {path.stretches[-1].names[1]}"
    allowed = {
        key: task.tolerance(key) for key in ("path", "path_orientation", "path_speed", "position")
    }
    t = _times(path, samples)
    t = np.clip(t, motion.x[0], motion.x[-1])
    q = motion(t)
    poses = arm.poses(q, t)
    points = np.array([pose.translation for pose in poses]) - path.woven(t)
    s = tracked(path, points, allowed["path"])
    P, T, _ = path.at(s)
    off = float(np.linalg.norm(points - P, axis=1).max())
    if off > allowed["path"]:
        yield "path", name, off, allowed["path"]
    if path.axis is not None:
        axes = np.array([pose.rotation[:, 2] for pose in poses])
        turned = 2.0 * np.arcsin(0.5 * np.linalg.norm(axes - path.axis(s), axis=1))
    else:
        wanted = path.rotations(s)
        turned = np.array([turn_between(R, p.rotation) for R, p in zip(wanted, poses, strict=True)])
    excess = turned - path.ahead(s)
    if excess.max() > allowed["path_orientation"]:
        yield "orientation", name, float(excess.max()), allowed["path_orientation"]
    # From one end to the other, and past each waypoint between at its given time.
    near = allowed["path"] + allowed["position"] + 1e-9
    marks = [(path.stretches[0].start, 0.0)]
    marks += [(one.end, end) for one, end in zip(path.stretches, path.ends, strict=True)]
    for time, length in marks:
        k = int(np.abs(t - time).argmin())
        if abs(s[k] - length) > near:
            yield "progress", f"{name} at {time:g} s", float(s[k]), length
    yield from _speed(task, motion, path, t, T, allowed["path_speed"])


def _speed(
    task: Task,
    motion: Motion,
    path: ToolPath,
    t: np.ndarray,
    T: np.ndarray,
    part: float,
) -> Iterator[Row]:
    """The velocity along the path: as given in the window, no faster and not back in the ramps."""
    velocity = task.arm.velocities(motion(t), motion(t, 1), t=t)[:, :3]
    velocity -= (path.woven(t + STEP) - path.woven(t - STEP)) / (2.0 * STEP)
    along = (velocity * T).sum(axis=1)
    speed = np.linalg.norm(velocity, axis=1)
    for one in path.stretches:
        room = part * one.speed
        name = f"{one.names[0]} to {one.names[1]}"
        inside = (t >= one.start - SLACK) & (t <= one.end + SLACK)
        full = inside & (t >= one.full[0]) & (t <= one.full[1])
        if along[inside].min() < -room:
            yield "direction", name, float(along[inside].min()), 0.0
        if speed[inside].max() > one.speed + room + SLACK:
            yield "speed", name, float(speed[inside].max()), one.speed + room
        if full.any() and along[full].min() < one.speed - room - SLACK:
            kind = "direction" if along[full].min() < 0.0 else "speed"
            yield kind, name, float(along[full].min()), one.speed - room
