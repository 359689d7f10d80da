"""A task for a robot arm: what it is to do, in typed parts; a scenario file says the same.

Each part is loaded when something of it is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
