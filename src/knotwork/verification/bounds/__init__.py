"""Proofs over all time from bounds on derivatives: effort, tool speed, distance to singularities.

Samples give the values of a quantity at some times, and a bound on its second derivative limits the
values between them. Together they are a proof.
"""

import lazy_loader

# Loaded on first use: checks without a robot need no Pinocchio.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
