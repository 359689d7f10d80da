"""Tool paths: lines, arcs and curves, the tool's orientation along them, and their timing."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
