"""Robots: a Pinocchio model with its tool, limits and named configurations."""

import lazy_loader

# Loaded on first use: the schema of a robot file needs no Pinocchio.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
