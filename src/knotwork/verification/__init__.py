"""Verification of a trajectory against its scenario, independent of planning."""

import lazy_loader

from knotwork.errors.old_names import with_old_names

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_RENAMED = {"torque_bound": "knotwork.verification.effort_bound"}
__getattr__ = with_old_names(_load, __name__, _RENAMED)
