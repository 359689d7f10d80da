"""Sweeps: variations of a scenario, each planned and checked, with a row of figures for each."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
