"""Mass, centre of mass and inertia of a tool and of held objects."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from knotwork.files.documents.values import LARGEST_NUMBER, Number, optional
from knotwork.task.task_part import TaskPart

Mass = Annotated[float, Field(strict=True, ge=0, le=LARGEST_NUMBER)]


class Inertia(TaskPart):
    """Moments of inertia about the centre of mass, named as in a URDF."""

    ixx: Number = Field(description="Moment about x [kg m²]")
    iyy: Number = Field(description="Moment about y [kg m²]")
    izz: Number = Field(description="Moment about z [kg m²]")
    ixy: Number = optional("Product of inertia [kg m²]", 0.0)
    ixz: Number = optional("Product of inertia [kg m²]", 0.0)
    iyz: Number = optional("Product of inertia [kg m²]", 0.0)
