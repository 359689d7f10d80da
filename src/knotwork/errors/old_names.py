"""Old names of attributes, options and what packages offer: they work for one version, and warn."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Mapping
from operator import attrgetter
from typing import Any


def warn_of_old_name(old: str, new: str) -> None:
    """Warn whoever called the caller of this function."""
    message = f"{old} is now {new}; the old name goes with the next version"
    warnings.warn(message, DeprecationWarning, stacklevel=3)


def with_old_names(
    load: Callable[[str], Any], package: str, renamed: Mapping[str, str]
) -> Callable[[str], Any]:
    """Make the `__getattr__` of a package that has old names.

    Args:
        load: Loads the other names.
        package: Name of the package.
        renamed: Old names in it, and the full new ones.
    """

    def load_any(name: str) -> Any:
        if name not in renamed:
            return load(name)
        warn_of_old_name(f"{package}.{name}", renamed[name])
        module, _, attribute = renamed[name].rpartition(".")
        return getattr(importlib.import_module(module), attribute)

    return load_any


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
