"""Proofs over all time from bounds on derivatives: torque, tool speed, distance to singularities.

Samples give a quantity at some times, and a bound on its second derivative limits its values
between them; both together are a proof.
"""

import lazy_loader

# Loaded on first use: checks without a robot need no Pinocchio.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
