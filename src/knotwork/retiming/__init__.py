"""A motion with another timing on the same path, and stops; no robot, no scenario."""

from knotwork.retiming.clock import Profile, checked_profile, inverse_time
from knotwork.retiming.composition import composed, cubic_through
from knotwork.retiming.ramps import slower_ramps
from knotwork.retiming.stops import first_rest, joint_stop, keeps_limits, stop_on_path

__all__ = [
    "Profile",
    "checked_profile",
    "composed",
    "cubic_through",
    "first_rest",
    "inverse_time",
    "joint_stop",
    "keeps_limits",
    "slower_ramps",
    "stop_on_path",
]
