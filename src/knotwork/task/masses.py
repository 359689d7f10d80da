"""Mass, centre of mass and inertia of a tool and of held objects."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from knotwork.files.documents.values import LARGEST_NUMBER, Number, optional, required
from knotwork.task.task_part import TaskPart

Mass = Annotated[float, Field(strict=True, ge=0, le=LARGEST_NUMBER)]


class Inertia(TaskPart):
    """Moments of inertia about the centre of mass, named as in a URDF."""

    ixx: Number = required("Moment about x", unit="kg m²")
    iyy: Number = required("Moment about y", unit="kg m²")
    izz: Number = required("Moment about z", unit="kg m²")
    ixy: Number = optional("Product of inertia", 0.0, unit="kg m²")
    ixz: Number = optional("Product of inertia", 0.0, unit="kg m²")
    iyz: Number = optional("Product of inertia", 0.0, unit="kg m²")
