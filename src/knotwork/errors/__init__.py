"""All errors that Knotwork raises on purpose.

All derive from `KnotworkError`, and each class declares its data as attributes.

The command line turns `InputError` into exit code 2 and `CheckFailedError` into exit code 1.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
