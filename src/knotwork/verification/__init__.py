"""Verification, independent of planning: does a trajectory do what its scenario asks for?"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
