"""A task for a robot arm in typed parts, which correspond to a scenario file.

Each part is loaded on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
