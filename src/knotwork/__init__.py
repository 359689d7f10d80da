"""Tool poses and speeds in, a verified C² joint trajectory out.

    import knotwork as kw

    plan = kw.plan("ur5_deburring")
    plan.report.raise_if_failed()
    plan.trajectory.velocity(1.2)  # joint velocities at 1.2 s [rad/s]
    plan.save("out")

Everything is loaded when it is first used, so that importing `knotwork` costs next to nothing.
"""

import os

import lazy_loader

from knotwork.errors.renamed import with_old_names

__version__ = "0.1.0"

_load, __dir__, _offered = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = with_old_names(__name__, _load)
# Its packages can be had as attributes too, but are names of their own.
_ROOMS = ("", "spline", "planning", "verification")
__all__ = [
    name
    for name in _offered
    if not any(os.path.isdir(os.path.join(__path__[0], room, name)) for room in _ROOMS)
]
