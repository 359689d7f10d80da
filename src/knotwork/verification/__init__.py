"""Verification, independent of planning: does a trajectory do what its scenario asks for?"""

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names
from knotwork.verification.checks import CHECKS as CHECKS
from knotwork.verification.checks import Check as Check
from knotwork.verification.finding import Finding as Finding
from knotwork.verification.motion import Motion as Motion
from knotwork.verification.report import Report as Report
from knotwork.verification.verdict import check as check

if TYPE_CHECKING:
    from knotwork.verification.bounds import Bound as Bound
    from knotwork.verification.bounds import singular_value_bound as singular_value_bound
    from knotwork.verification.bounds import tool_acceleration_bound as tool_acceleration_bound
    from knotwork.verification.bounds import tool_angle_bound as tool_angle_bound
    from knotwork.verification.bounds import tool_distance_bound as tool_distance_bound
    from knotwork.verification.bounds import tool_speed_bound as tool_speed_bound
    from knotwork.verification.bounds import tool_turning_bound as tool_turning_bound
    from knotwork.verification.bounds import torque_bound as torque_bound

__getattr__, __dir__, __all__ = lazy_names(__name__)
