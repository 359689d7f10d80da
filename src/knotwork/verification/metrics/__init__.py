"""Metrics of a motion: of the joints, and of the tool along its path."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
