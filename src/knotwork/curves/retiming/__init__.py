"""New timings of a motion on the same path, and stops; without robot or scenario."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
