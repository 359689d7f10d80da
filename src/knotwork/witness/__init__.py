"""The check: an independent witness of whether a trajectory does what its scenario asks for."""

from knotwork.witness.report import (
    Defect,
    Jump,
    LimitUse,
    Report,
    Requirement,
    Singularity,
)
from knotwork.witness.verdict import check

__all__ = ["Defect", "Jump", "LimitUse", "Report", "Requirement", "Singularity", "check"]
