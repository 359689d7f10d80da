"""Inverse kinematics of poses (eq 3) and velocities (eq 4), and distance from singularities."""

import lazy_loader

from knotwork.errors.old_names import with_old_names

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_RENAMED = {"Branch": "knotwork.robot.kinematics.PoseSolution"}
__getattr__ = with_old_names(_load, __name__, _RENAMED)
