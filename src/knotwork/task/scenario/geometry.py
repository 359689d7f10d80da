"""Rotations, placements and frames of a scenario file, in SI, computed by Pinocchio."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray, rotation_error
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.extended_curve import ExtendedCurve
from knotwork.curves.tool_paths.seam import seam_frames, torch_rotation
from knotwork.curves.tool_paths.task_frame import BASE_FRAME, TaskFrame
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError, PathError
from knotwork.files.documents import Location, Locations
from knotwork.task import Frame, FrameMotion, Placement, SeamTorch

FILE_ROTATION_TOLERANCE = 1e-3
"""Tolerance for values in a file, which are often rounded to four digits.

A larger deviation from a rotation is a mistake.
"""

_AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


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


def rotation(placement: Placement, locations: Locations, location: Location) -> FloatArray:
    """Rotation matrix, shape (3, 3), of a placement's orientation; the identity if it has none.

    Args:
        placement: Placement as given in the file, in SI.
        locations: Locations in the file, for errors.
        location: Location of the placement.

    Raises:
        DocumentError: A quaternion or a matrix is not a rotation.
    """
    for name, order in (("quaternion_xyzw", (3, 0, 1, 2)), ("quaternion_wxyz", (0, 1, 2, 3))):
        values = getattr(placement, name)
        if values is not None:
            return _from_quaternion(
                np.array([values[i] for i in order]), locations, (*location, name)
            )
    if placement.torch is not None:
        return _torch_axes(placement.torch, locations, (*location, "torch"))
    if placement.rotation_matrix is not None:
        matrix = np.array(placement.rotation_matrix)
        return _from_matrix(matrix, locations, (*location, "rotation_matrix"))
    if placement.rotation_vector is not None:
        return np.asarray(pin.exp3(np.array(placement.rotation_vector)))
    if placement.rpy is not None:
        return np.asarray(pin.rpy.rpyToMatrix(np.array(placement.rpy)))
    result = np.eye(3)
    if placement.euler is not None:
        for axis, turn in zip(placement.euler.order, placement.euler.angles, strict=True):
            result = result @ pin.exp3(turn * np.array(_AXES[axis]))
    return result


def _from_quaternion(wxyz: FloatArray, locations: Locations, location: Location) -> FloatArray:
    norm = float(np.linalg.norm(wxyz))
    if abs(norm - 1) > FILE_ROTATION_TOLERANCE:
        raise locations.error(
            location,
            f"has norm {norm:.6g}",
            f"a unit quaternion, norm 1 within {FILE_ROTATION_TOLERANCE:g}",
        )
    w, x, y, z = (float(value) for value in wxyz / norm)
    return np.asarray(pin.Quaternion(w, x, y, z).matrix())


def _torch_axes(torch: SeamTorch, locations: Locations, location: Location) -> FloatArray:
    try:
        axes = seam_frames([torch.seam], torch.normal)[0]
        turned = torch_rotation(torch.work_angle, torch.travel_angle, torch.tangent)
        return np.asarray(axes @ turned)
    except PathError as error:
        raise locations.error(location, str(error)) from error


def _from_matrix(matrix: FloatArray, locations: Locations, location: Location) -> FloatArray:
    fault = rotation_error(matrix, FILE_ROTATION_TOLERANCE)
    if fault:
        raise locations.error(
            location,
            f"is not a rotation matrix: {fault}",
            f"orthonormal rows within {FILE_ROTATION_TOLERANCE:g}, right-handed",
        )
    u, _, vt = np.linalg.svd(matrix)  # the nearest rotation undoes the rounding
    return np.asarray(u @ vt)


def read_placement(placement: Placement, locations: Locations, location: Location) -> pin.SE3:
    """Make a placement in its parent frame from its values in the file, in SI.

    Raises:
        DocumentError: As for `rotation`.
    """
    return pin.SE3(rotation(placement, locations, location), np.array(placement.position))


class Frames(dict[str, TaskFrame]):
    """The named frames of a scenario, and `"base"`.

    Args:
        frames: Frames as given in the file, in SI.
        locations: Locations in the file, for errors.

    Raises:
        DocumentError: A frame is placed in one that does not exist, frames are placed in a circle,
            or a frame has a reserved name.
    """

    def __init__(self, frames: Mapping[str, Frame], locations: Locations) -> None:
        super().__init__(base=BASE_FRAME)
        self._locations = locations
        for reserved in ("base", "tool"):
            if reserved in frames:
                raise locations.error(
                    ("frames", reserved), "is a reserved name", "any other name for a frame"
                )
        for name, frame in frames.items():
            if frame.parent != name:
                others = (choice for choice in frames if choice != name)
                locations.check_name(
                    ("frames", name, "in"), "frame", frame.parent, ["base", *others]
                )
        parents = {name: [frame.parent] for name, frame in frames.items()}
        try:
            ordered = [*TopologicalSorter(parents).static_order()]
        except CycleError as error:
            circle = error.args[1][::-1]  # each frame before its parent
            raise locations.error(
                ("frames", circle[0], "in"), f"frames placed in a circle: {' in '.join(circle)}"
            ) from error
        for name in ordered:
            if name in frames:
                self[name] = self._moving(name, frames[name])

    def _moving(self, name: str, frame: Frame) -> TaskFrame:
        """A frame, whose parent is placed already."""
        location: Location = ("frames", name)
        placement = read_placement(frame, self._locations, location)
        moving = self[frame.parent].inside(placement)
        if frame.on is not None:
            moving = replace(moving, link=frame.on)
        if frame.moves is not None:
            moving = move_frame(moving, frame.moves, self._locations, name)
        return moving

    def checked_name(self, name: str, location: Location, *also: str) -> str:
        """Check that a name is a frame, or one of the other names, and return it.

        Raises:
            DocumentError: The frame does not exist.
        """
        self._locations.check_name(location, "frame", name, [*self, *also])
        return name


def move_frame(frame: TaskFrame, motion: FrameMotion, locations: Locations, name: str) -> TaskFrame:
    """A frame in motion.

    Args:
        frame: The frame without its own motion.
        motion: Its motion, in SI.
        locations: Locations in the file, for errors.
        name: Name of the frame.

    Raises:
        DocumentError: The file is missing, or has other joints.
    """
    if motion.file is not None:
        return _move_by_file(frame, motion.file, motion.at, locations, name)
    axes, is_revolute, rates = [], [], []
    for vector, turn in ((motion.linear, False), (motion.angular, True)):
        rate = float(np.linalg.norm(vector or (0.0,)))
        if rate > 0.0:
            axes.append(np.array(vector) / rate)
            is_revolute.append(turn)
            rates.append(rate)
    if not rates:
        return frame
    c = np.array([[rates], [np.zeros(len(rates))]])
    steady = ExtendedCurve(PiecewisePolynomial(c, [0.0, 1.0]), holds_ends=False, delay=motion.at)
    return frame.with_joints(np.array(axes), tuple(is_revolute), steady, name)


def _move_by_file(
    frame: TaskFrame, file: str, begin: float, locations: Locations, name: str
) -> TaskFrame:
    location: Location = ("frames", name, "moves", "file")
    path = locations.named_file(file, location)
    try:
        motion = _read_motion(path)
    except InputError as error:
        raise locations.error(location, str(error)) from error
    order = [motion.joint_names.index(name) for name in FRAME_JOINTS if name in motion.joint_names]
    names = [motion.joint_names[i] for i in order]
    curve = PiecewisePolynomial(motion.polynomial.c[:, :, order], motion.polynomial.x)
    axes = np.eye(3)[["xyz".index(FRAME_JOINTS[name][1]) for name in names]]
    is_revolute = tuple(FRAME_JOINTS[name][0] == "rad" for name in names)
    delayed = ExtendedCurve(curve, delay=begin - float(curve.x[0]))
    return frame.with_joints(axes, is_revolute, delayed, name)


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
