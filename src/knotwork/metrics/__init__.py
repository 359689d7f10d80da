"""Figures of a motion: at the joints, and of the tool along its path."""

from knotwork.metrics.joint_motion import (
    Peak,
    acceleration_jump,
    end_acceleration,
    integral_of_square,
    peak,
    position_miss,
    squared_effort,
    velocity_fluctuation,
    velocity_miss,
)

__all__ = [
    "Peak",
    "acceleration_jump",
    "end_acceleration",
    "integral_of_square",
    "peak",
    "position_miss",
    "squared_effort",
    "velocity_fluctuation",
    "velocity_miss",
]
