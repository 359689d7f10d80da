"""The check: an independent witness of whether a trajectory does what its scenario asks for."""

from knotwork.witness.check import check
from knotwork.witness.report import (
    Defect,
    Jump,
    LimitUse,
    Report,
    Requirement,
    Singularity,
)

__all__ = ["Defect", "Jump", "LimitUse", "Report", "Requirement", "Singularity", "check"]
