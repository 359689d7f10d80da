"""MuJoCo: keyframes of a motion, as an MJCF file to include in a model or to read by `MjSpec`."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, indent, tostring

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import JointTrajectory
from knotwork.curves.trajectory.sampling import make_sample_times
from knotwork.errors.arguments import require_number
from knotwork.files.export.table import DEFAULT_RATE

MAX_KEYFRAMES = 1_000_000
"""Maximum number of keyframes."""


def to_mujoco(motion: JointTrajectory, *, rate: float = DEFAULT_RATE, lead: float = 0.0) -> str:
    """Write keyframes: times, positions, velocities, and controls of position actuators.

    The model must have exactly these joints in this order, and a position actuator for each.
    `custom` has the names of the joints.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> text = to_mujoco(lift, rate=2)
    >>> text.count("<key "), 'qpos="0.5" qvel="1.5" ctrl="0.5"' in text
    (3, True)

    The force of an actuator with the gains kp and kv is kp (ctrl - q) - kv q̇, so it has a delay of
    kv/kp. The control ctrl = q + lead q̇ compensates for it if lead is that delay.

    Args:
        motion: The motion [rad or m].
        rate: Keyframes per second [Hz]; the last one is exactly at the end.
        lead: kv/kp of the actuators [s].

    Raises:
        InputError: The rate or the lead is out of range.
    """
    lead = require_number(lead, "lead, kv/kp of the actuators,", "s", minimum=0.0)
    time = make_sample_times(motion.start_time, motion.end_time, rate, MAX_KEYFRAMES)
    root = Element("mujoco", model="knotwork_motion")
    names = SubElement(root, "custom")
    SubElement(names, "text", name="joints", data=" ".join(motion.joint_names))
    keys = SubElement(root, "keyframe")
    rows = zip(time.tolist(), motion.position(time), motion.velocity(time), strict=True)
    for i, (at, q, v) in enumerate(rows):
        numbers = {"qpos": _numbers(q), "qvel": _numbers(v), "ctrl": _numbers(q + lead * v)}
        SubElement(keys, "key", {"name": f"knotwork_{i}", "time": repr(at), **numbers})
    indent(root)
    return tostring(root, encoding="unicode") + "\n"


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.17g}" for value in values)
