"""Faults of what joints and tool do at waypoints, in waits, at limits, and of smoothness."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin

from judge.cases import (
    Case,
    Fault,
    Rng,
    Shelf,
    arm_case,
    bumped,
    joint_case,
    posed,
    sign,
    size,
    swung,
    written,
)
from judge.motion import Motion
from judge.task import Task
from judge.verdict import FASTEST, JUMPS

KINDS = ("position", "velocity", "acceleration", "jerk")


def _room(case: Case, t: float) -> float:
    """How far a waypoint is from all others and from the wait [s]."""
    marks = [*case.extra["times"], *case.extra["wait"]]
    return min((abs(t - other) for other in marks if other != t), default=1.0)


def _waypoint(case: Case, rng: Rng) -> int:
    """Of one that is passed, or of an end."""
    wait = case.extra["wait"][0]
    return int(rng.choice([i for i, t in enumerate(case.extra["times"]) if t != wait]))


def _joint(case: Case, rng: Rng) -> int:
    return int(rng.integers(len(case.motion.names)))


def _off(motion: float, rng: Rng, most: float = 1.0) -> float:
    return sign(rng) * min(motion * size(rng, 5.0), most)


def _without_ends(case: Case) -> Case:
    data = copy.deepcopy(case.data)
    data.pop("end_acceleration", None)
    return replace(case, data=data)


def pose_of_joints(case: Case, rng: Rng, shelf: Shelf) -> Case:
    case, i, j = _without_ends(case), _waypoint(case, rng), _joint(case, rng)
    t, off = case.extra["times"][i], _off(1e-6, rng, 0.1)
    if rng.random() < 0.5:
        return case.with_motion(bumped(case.motion, j, t, 0.9 * min(_room(case, t), 0.5), off))
    wrong = case.with_data({})
    wrong.data["waypoints"][i]["joints"][case.motion.names[j]] += off / case.extra["scale"][j]
    return wrong


def velocity_of_joints(case: Case, rng: Rng, shelf: Shelf) -> Case:
    case, i, j = _without_ends(case), _waypoint(case, rng), _joint(case, rng)
    t, off = case.extra["times"][i], _off(1e-6, rng, 0.3)
    if rng.random() < 0.5:
        return case.with_motion(swung(case.motion, j, t, 0.9 * min(_room(case, t), 0.5), off))
    wrong = case.with_data({})
    row = wrong.data["waypoints"][i]
    row.pop("stop", None)
    given = row.setdefault("velocity", dict.fromkeys(case.motion.names, 0.0))
    given[case.motion.names[j]] += off / case.extra["scale"][j]
    return wrong


def time(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """Too late, too slow, too fast, or cut off."""
    motion = case.motion
    off = sign(rng) * 1e-9 * max(1.0, motion.x[-1]) * size(rng, 7.0)
    how = int(rng.integers(4))
    if how == 0:
        return case.with_motion(Motion(motion.names, motion.x + off, motion.c))
    if how == 1:
        factor = 1.0 + off / motion.x[-1]
        powers = factor ** np.arange(len(motion.c) - 1.0, -1.0, -1.0)
        c = motion.c / powers[:, None, None]
        return case.with_motion(Motion(motion.names, motion.x * factor, c))
    if how == 2:
        return case.with_motion(Motion(motion.names, motion.x[:-1], motion.c[:, :-1]))
    wrong = case.with_data({})
    wrong.data["waypoints"][-1]["time"] += abs(off)
    return wrong


def hold(case: Case, rng: Rng, shelf: Shelf) -> Case:
    start, end = case.extra["wait"]
    half = 0.5 * (end - start) * rng.uniform(0.05, 0.95)
    middle = rng.uniform(start + half, end - half)
    off = _off(1e-6, rng, 0.1)
    return case.with_motion(bumped(case.motion, _joint(case, rng), middle, half, off))


def limit(order: int) -> Any:
    """A limit just below the peak, or a bump beyond one."""

    def make(case: Case, rng: Rng, shelf: Shelf) -> Case:
        motion, j = case.motion, _joint(case, rng)
        name, scale = motion.names[j], case.extra["scale"][j]
        low, high = (one[j] for one in motion.critical(order, motion.x[0], motion.x[-1]))
        excess = 1e-9 * max(1.0, -low, high) * size(rng, 7.0)
        if order == 0:
            far = 10.0 ** rng.uniform(-2, 2)
            excess = min(excess, 0.5 * (high - low))
            pair = [low - far, high - excess] if rng.random() < 0.5 else [low + excess, high + far]
            return case.with_data({"limits": {"position": {name: [one / scale for one in pair]}}})
        peak = max(-low, high)
        allowed = max(peak - excess, 0.5 * peak) / scale
        for_all = rng.random() >= 0.8 and len(motion.names) == 1
        share = rng.uniform(0.3, 1.0) if rng.random() < 0.3 else 1.0
        given = allowed / share if for_all else {name: allowed / share}
        margin = {"used_fraction": share} if share < 1.0 else {}
        return case.with_data({"limits": {KINDS[order]: given, **margin}})

    return make


def jump(order: int) -> Any:
    """Position, velocity or acceleration jumps, where no waypoint says otherwise."""

    def make(case: Case, rng: Rng, shelf: Shelf) -> Case:
        motion, j = case.motion, _joint(case, rng)
        wait = case.extra["wait"]
        parts = [(motion.x[0], wait[0]), (wait[1], motion.x[-1])]
        low, high = parts[int(rng.integers(2))]
        half = 0.5 * (high - low) * rng.uniform(0.05, 0.9)
        middle = rng.uniform(low + half, high - half)
        wanted = JUMPS[order] * size(rng, 4.0)
        # the least jump at one of the breaks of a bump of height 1
        step = 2.0 * half / (order + 1)
        least = (1.0, 1.0 / step, 4.0 / 3.0 / step**2)[order]
        bump = bumped(motion, j, middle, half, sign(rng) * wanted / least, degree=order)
        return written(case, bump)

    return make


def too_fast(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """Smooth as mathematics has it, but faster than any drive."""
    motion, j, order = case.motion, _joint(case, rng), int(rng.integers(3))
    wait = case.extra["wait"]
    half = 10.0 ** rng.uniform(-7, -3)
    middle = rng.uniform(motion.x[0] + half, wait[0] - half)
    step = 0.5 * half
    peak = (1.0, 1.5, 4.5)[order] / step ** (order + 1)
    height = sign(rng) * 2.0 * FASTEST[order] * rng.uniform(1.0, 5.0) / peak
    return written(case, bumped(motion, j, middle, half, height))


def end_acceleration(case: Case, rng: Rng, shelf: Shelf) -> Case:
    """Not zero at an end, where zero is given."""
    motion, j = case.motion, _joint(case, rng)
    t = float(motion.x[int(rng.choice([0, -1]))])
    half = 0.9 * min(_room(case, t), 1.0)
    wanted = _off(1e-6, rng, 1.0)
    # Its acceleration is that of a bump; the task is written from the motion, and has none.
    bump = bumped(motion, j, t, half, wanted * (0.5 * half) ** 2 / 3.0)
    return written(case, bump)


def tool_pose(case: Case, rng: Rng, shelf: Shelf) -> Case:
    i = _waypoint(case, rng)
    if rng.random() < 0.3:  # at an end, where the velocity stays zero whatever the pose
        t, j = case.extra["times"][int(rng.choice([0, -1]))], _joint(case, rng)
        half = 0.9 * min(_room(case, t), 0.5)
        return case.with_motion(bumped(case.motion, j, t, half, _off(1e-4, rng, 0.1)))
    wrong = case.with_data({})
    row = wrong.data["waypoints"][i]["pose"]
    off = abs(_off(1e-6, rng, 0.1))
    way = rng.normal(size=3)
    way *= off / np.linalg.norm(way)
    if rng.random() < 0.5:
        row["position"] = (np.array(row["position"]) + way / case.extra["length"]).tolist()
    else:
        row["rotation_matrix"] = (pin.exp3(way) @ np.array(row["rotation_matrix"])).tolist()
    return wrong


def tool_velocity(case: Case, rng: Rng, shelf: Shelf) -> Case:
    i = _waypoint(case, rng)
    wrong = case.with_data({})
    row = wrong.data["waypoints"][i]
    given = row.setdefault("velocity", {"linear": [0.0] * 3, "angular": [0.0] * 3})
    way = rng.normal(size=3)
    way *= abs(_off(1e-6, rng, 0.3)) / np.linalg.norm(way)
    if rng.random() < 0.5:
        given["linear"] = (np.array(given["linear"]) + way / case.extra["length"]).tolist()
    else:
        given["angular"] = (np.array(given["angular"]) + way).tolist()
    return wrong


def _shaken(case: Case, rng: Rng, shelf: Shelf) -> tuple[Case, Task, np.ndarray]:
    """The case, sometimes with a spike that only dense samples see; with its task and samples."""
    motion = case.motion
    if rng.random() < 0.4:
        half = 10.0 ** rng.uniform(-2.2, -1.0)
        wait = case.extra["wait"]
        middle = rng.uniform(half, wait[0] - half)
        height = sign(rng) * 10.0 ** rng.uniform(-1.5, -0.5) * half
        motion = bumped(motion, _joint(case, rng), middle, half, height)
        case = posed(case.with_motion(motion), shelf.arm(case.data["robot"]))
    task = Task(case.data, shelf.folder)
    return case, task, motion.dense()


def tool_limit(kind: str) -> Any:
    """A limit on effort, the speed or acceleration of the tool or a link, or a singular value."""

    def make(case: Case, rng: Rng, shelf: Shelf) -> Case:
        case, task, t = _shaken(case, rng, shelf)
        arm, length, motion = task.arm, case.extra["length"], case.motion
        q, v, a = (motion(t, order) for order in range(3))
        excess = 1e-9 * size(rng, 7.0)

        def below(peak: float) -> float:
            return max(peak - excess * max(1.0, peak), 0.5 * peak)

        limits = dict(case.data["limits"])
        if kind == "effort":
            peak = np.abs(arm.efforts(q, v, a)).max(axis=0)
            j = int(rng.integers(len(peak)))
            if peak[j] < 1e-3:
                j = int(peak.argmax())
            others = {n: 10.0 * float(p) + 1.0 for n, p in zip(arm.names, peak, strict=True)}
            limits["effort"] = {**others, arm.names[j]: below(float(peak[j]))}
        elif kind == "tool speed":
            peak = np.linalg.norm(arm.velocities(q, v)[:, :3], axis=1).max()
            limits["tool_speed"] = below(float(peak)) / length
        elif kind == "tool acceleration":
            limits["tool_acceleration"] = below(float(arm.accelerations(q, v, a).max())) / length
        elif kind == "frame speed":
            moving = [f.name for f in arm.model.frames if f.parentJoint == arm.joints[-1]]
            link = next(n for n in moving if arm.model.existFrame(n, pin.BODY))
            peak = np.linalg.norm(arm.velocities(q, v, link)[:, :3], axis=1).max()
            limits["frame_speed"] = {"frame": link, "speed": below(float(peak)) / length}
        else:
            limits["singular_value"] = float(arm.singular_values(q).min()) + excess
        return case.with_data({"limits": limits})

    return make


FAULTS: dict[str, Fault] = {
    "joint position at a waypoint": Fault(joint_case, pose_of_joints, {"pose"}, 800),
    "joint velocity at a waypoint": Fault(joint_case, velocity_of_joints, {"velocity"}, 800),
    "time": Fault(joint_case, time, {"time"}, 660),
    "hold": Fault(joint_case, hold, {"hold"}, 680, beside={"jump"}),
    "acceleration at an end": Fault(joint_case, end_acceleration, {"end acceleration"}, 500),
    **{
        f"{kind} limit": Fault(joint_case, limit(order), {f"{kind} limit"}, 500)
        for order, kind in enumerate(KINDS)
    },
    **{
        f"{kind} jumps": Fault(joint_case, jump(order), {"jump"}, 500)
        for order, kind in enumerate(KINDS[:3])
    },
    "faster than any drive": Fault(joint_case, too_fast, {"jump"}, 500),
    "tool pose": Fault(arm_case, tool_pose, {"pose"}, 350, samples=50),
    "tool velocity": Fault(arm_case, tool_velocity, {"velocity"}, 300, samples=50),
    **{
        f"{kind} limit of an arm": Fault(arm_case, tool_limit(kind), {kind, f"{kind} limit"}, 60)
        for kind in ("effort", "tool speed", "tool acceleration", "frame speed", "singular value")
    },
}
