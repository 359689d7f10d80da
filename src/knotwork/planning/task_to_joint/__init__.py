"""A scenario's waypoints at the joints: inverse kinematics, position (eq 3) and velocity (eq 4)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
