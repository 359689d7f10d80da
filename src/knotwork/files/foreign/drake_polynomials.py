"""Piecewise polynomials written by Drake's `yaml_dump_typed`."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from knotwork.errors import InputError
from knotwork.files.documents import Document, Finite, StrictModel, validate
from knotwork.files.foreign.point_table import Joints
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.trajectory import JointTrajectory


class _Polynomials(StrictModel):
    """Fields of `drake::trajectories::PiecewisePolynomial`, and optional joint names."""

    breaks: list[Finite] = Field(min_length=2)
    polynomials: list[list[list[list[Finite]]]]
    joint_names: list[str] | None = None


def read_polynomials(document: Document, joints: Joints) -> JointTrajectory:
    """Read a matrix of polynomials per segment, one column, one row per joint.

    Args:
        document: `breaks`, and `polynomials` by segment, row and column, coefficients from the
            lowest power, in the time since the segment's break. Rows are in the order of
            `joint_names` if given, else in that of the joints.
        joints: The known joints.

    Raises:
        DocumentError: The shape or the joints differ, or the breaks do not increase.
    """
    polynomials = validate(_Polynomials, document)
    names = list(joints.names) if polynomials.joint_names is None else polynomials.joint_names
    if sorted(names) != sorted(joints.names):
        accepted = f"each of {', '.join(joints.names)} once, in any order"
        raise document.error(("joint_names",), f"differs from that of {joints.owner}", accepted)
    segments, size = polynomials.polynomials, len(joints.names)
    if len(segments) != len(polynomials.breaks) - 1:
        fault = f"has {len(segments)} segments"
        raise document.error(
            ("polynomials",), fault, f"{len(polynomials.breaks) - 1}, between breaks"
        )
    degree = max((len(c) for segment in segments for row in segment for c in row), default=0)
    coefficients = np.zeros((max(degree, 1), len(segments), size))
    places = [joints.names.index(name) for name in names]
    for i, segment in enumerate(segments):
        if len(segment) != size or any(len(row) != 1 for row in segment):
            shape = f"{len(segment)} rows of {sorted({len(row) for row in segment})} columns"
            accepted = f"{size} rows, one for each joint of {joints.owner}, of one column"
            raise document.error(("polynomials", i), f"has {shape}", accepted)
        for j, (row,) in enumerate(segment):
            coefficients[coefficients.shape[0] - len(row) :, i, places[j]] = row[::-1]
    try:
        curve = PiecewisePolynomial(coefficients, np.array(polynomials.breaks))
    except InputError as error:
        raise document.error(("breaks",), str(error)) from error
    order = "" if polynomials.joint_names else ", rows in the order of the joints"
    file = document.file.name if document.file is not None else ""
    description = f"{len(segments)} polynomials of degree {len(coefficients) - 1}{order}"
    planner = f"{file} (Drake), {description}"
    return JointTrajectory(joints.names, curve, joint_units=joints.units, planner=planner)
