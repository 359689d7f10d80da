"""A motion with another timing on the same path, and stops; no robot, no scenario."""

from knotwork.retiming.clock import inverse_time, override
from knotwork.retiming.composition import composed, cubic_through
from knotwork.retiming.stops import first_rest, joint_stop, stop_on_path

__all__ = [
    "composed",
    "cubic_through",
    "first_rest",
    "inverse_time",
    "joint_stop",
    "override",
    "stop_on_path",
]
