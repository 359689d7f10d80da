"""Verification, independent of planning: does a trajectory do what its scenario asks for?"""

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names
from knotwork.verification.checks import CHECKS, Check
from knotwork.verification.finding import Finding
from knotwork.verification.motion import Motion
from knotwork.verification.report import Report
from knotwork.verification.verdict import check

if TYPE_CHECKING:
    from knotwork.verification.bounds import (
        Bound,
        singular_value_bound,
        tool_acceleration_bound,
        tool_speed_bound,
        torque_bound,
    )

__all__ = [
    "CHECKS",
    "Bound",
    "Check",
    "Finding",
    "Motion",
    "Report",
    "check",
    "singular_value_bound",
    "tool_acceleration_bound",
    "tool_speed_bound",
    "torque_bound",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "bounds": (
            "Bound",
            "singular_value_bound",
            "tool_acceleration_bound",
            "tool_speed_bound",
            "torque_bound",
        )
    },
)
