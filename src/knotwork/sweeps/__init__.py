"""Many scenarios from one: values varied, each planned and checked, a row of figures for each."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
