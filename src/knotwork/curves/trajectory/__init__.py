"""Motions of named joints: `JointTrajectory`, its samples and its exports."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
