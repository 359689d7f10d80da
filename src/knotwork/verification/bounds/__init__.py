"""Proofs over all time from bounds on derivatives: torque, tool speed, nearness to singularities.

Samples say what a quantity is at some times. A bound on its second derivative says how far it can
go in between; the two together are a proof.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.verification.bounds.result import Bound as Bound
    from knotwork.verification.bounds.singular import singular_value_bound as singular_value_bound
    from knotwork.verification.bounds.tool import tool_acceleration_bound as tool_acceleration_bound
    from knotwork.verification.bounds.tool import tool_speed_bound as tool_speed_bound
    from knotwork.verification.bounds.tool_pose import tool_angle_bound as tool_angle_bound
    from knotwork.verification.bounds.tool_pose import tool_distance_bound as tool_distance_bound
    from knotwork.verification.bounds.tool_pose import tool_turning_bound as tool_turning_bound
    from knotwork.verification.bounds.torque import torque_bound as torque_bound

# Looked up when first used, so that checks without a robot load no Pinocchio.
__getattr__, __dir__, __all__ = lazy_names(__name__)
