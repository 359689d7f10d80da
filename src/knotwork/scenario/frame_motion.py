"""Known motions of a scenario's frames, from constant speeds or a file."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np

from knotwork.errors import InputError
from knotwork.files.documents import Location, Places
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.polynomial.endless import EndlessCurve
from knotwork.spline.trajectory import JointTrajectory
from knotwork.task import FrameMotion
from knotwork.tool_paths.moving_frame import MovingFrame

FRAME_JOINTS = {
    "x": ("m", "x"),
    "y": ("m", "y"),
    "z": ("m", "z"),
    "yaw": ("rad", "z"),
    "pitch": ("rad", "y"),
    "roll": ("rad", "x"),
}
"""Accepted joints of a file with a frame's motion, in kinematic order: unit and
axis."""

FRAME_JOINTS_TEXT = "x, y, z [m], yaw, pitch, roll [rad]"


def move_frame(
    frame: MovingFrame, motion: FrameMotion, places: Places, place: Location
) -> MovingFrame:
    """A frame in motion.

    Args:
        frame: The frame without its own motion.
        motion: Its motion, in SI.
        places: Places in the file, for errors.
        place: Location of the motion.

    Raises:
        DocumentError: The file is missing, or has other joints.
    """
    if motion.file is not None:
        return _move_by_file(frame, motion.file, motion.at, places, place)
    axes, turns, rates = [], [], []
    for vector, turn in ((motion.linear, False), (motion.angular, True)):
        rate = float(np.linalg.norm(vector or (0.0,)))
        if rate > 0.0:
            axes.append(np.array(vector) / rate)
            turns.append(turn)
            rates.append(rate)
    if not rates:
        return frame
    c = np.array([[rates], [np.zeros(len(rates))]])
    steady = EndlessCurve(PiecewisePolynomial(c, [0.0, 1.0]), stands=False, delay=motion.at)
    return frame.with_joints(np.array(axes), tuple(turns), steady)


def _move_by_file(
    frame: MovingFrame, file: str, begin: float, places: Places, place: Location
) -> MovingFrame:
    folder = places.file.parent if places.file is not None else Path()
    try:
        motion = _read_motion(folder / os.path.expanduser(file))
    except InputError as error:
        raise places.error((*place, "file"), str(error)) from error
    order = [motion.joint_names.index(name) for name in FRAME_JOINTS if name in motion.joint_names]
    names = [motion.joint_names[i] for i in order]
    curve = PiecewisePolynomial(motion.polynomial.c[:, :, order], motion.polynomial.x)
    axes = np.eye(3)[["xyz".index(FRAME_JOINTS[name][1]) for name in names]]
    turns = tuple(FRAME_JOINTS[name][0] == "rad" for name in names)
    return frame.with_joints(axes, turns, EndlessCurve(curve, delay=begin - float(curve.x[0])))


def _read_motion(path: Path) -> JointTrajectory:
    from knotwork.files.documents.csv_rows import read_rows
    from knotwork.files.foreign.trajectory_files import CSV, read_trajectory

    names = list(FRAME_JOINTS)
    if path.suffix.lower() in CSV:
        words = {word for head in read_rows(path).headings for word in re.split("[^a-z]+", head)}
        names = [name for name in FRAME_JOINTS if name in words]
    units = [FRAME_JOINTS[name][0] for name in names]
    motion, faults = read_trajectory(path, names, units, owner="a moving frame")
    known = zip(motion.joint_names, motion.joint_units, strict=True)
    faults += [
        f"{name} [{unit}]" for name, unit in known if FRAME_JOINTS.get(name, ("", ""))[0] != unit
    ]
    if faults:
        raise InputError(
            f"{path}: {', '.join(faults)}; accepted: joints {FRAME_JOINTS_TEXT}, or some of them"
        )
    return motion
