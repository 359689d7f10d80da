"""Old names of attributes and options, which work for one version and warn of the new ones."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from operator import attrgetter
from typing import Any


def warn_of_old_name(old: str, new: str) -> None:
    """Warn whoever called the caller of this function."""
    message = f"{old} is now {new}; the old name goes with the next version"
    warnings.warn(message, DeprecationWarning, stacklevel=3)


class OldAttribute:
    """An old name of an attribute.

    Args:
        new: The new name, which may be that of an attribute's attribute, such as `limits.jerk`.
    """

    def __init__(self, new: str) -> None:
        self.new = new

    def __set_name__(self, owner: type, name: str) -> None:
        self.old = f"{owner.__name__}.{name}"

    def __get__(self, instance: Any, owner: type) -> Any:
        if instance is None:
            return self
        warn_of_old_name(self.old, self.new)
        return attrgetter(self.new)(instance)


def renamed_option(options: Mapping[str, Any], old: str, new: str) -> dict[str, Any]:
    """Options in which one has its new name."""
    if old in options:
        warn_of_old_name(f"option {old!r}", repr(new))
    return {new if name == old else name: value for name, value in options.items()}
