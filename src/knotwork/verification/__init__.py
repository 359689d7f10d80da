"""Verification of a trajectory against its scenario, independent of planning."""

from typing import Any

import lazy_loader

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name != "torque_bound":
        return _load(name)
    from knotwork.errors.old_names import warn_of_old_name

    warn_of_old_name(f"knotwork.verification.{name}", "effort_bound")
    return _load("effort_bound")
