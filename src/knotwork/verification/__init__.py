"""Verification, independent of planning: does a trajectory do what its scenario asks for?"""

from knotwork.verification.report import (
    Defect,
    Jump,
    LimitUse,
    Report,
    Requirement,
    Singularity,
)
from knotwork.verification.verdict import check

__all__ = ["Defect", "Jump", "LimitUse", "Report", "Requirement", "Singularity", "check"]
