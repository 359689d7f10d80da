"""Pictures of motions, scenes and reports. Matplotlib is loaded with the first picture.

No function changes the global state of Matplotlib, because figures are made without `pyplot`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
