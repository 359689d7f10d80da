"""Verification of a trajectory against its scenario, independent of planning."""

from typing import Any

import lazy_loader

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    return _load("effort_bound" if name == "torque_bound" else name)  # its old name
