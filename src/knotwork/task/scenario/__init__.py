"""Scenarios: tasks for a robot arm in a YAML file, or as a mapping in Python."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
