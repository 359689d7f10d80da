"""Robots: a Pinocchio model, the tool it carries, its limits and its named configurations."""

import lazy_loader

# Looked up when first used, so that the schema of a robot file can be had without Pinocchio.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
