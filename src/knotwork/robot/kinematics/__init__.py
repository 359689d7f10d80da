"""Inverse kinematics of poses (eq 3) and velocities (eq 4), and distance from singularities."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
