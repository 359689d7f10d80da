"""Proofs over all time from bounds on derivatives: torque, tool speed, nearness to singularities.

Samples say what a quantity is at some times. A bound on its second derivative says how far it can
go in between; the two together are a proof.
"""

import lazy_loader

# Looked up when first used, so that checks without a robot load no Pinocchio.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
