"""Packages that only one format needs, imported on demand."""

from __future__ import annotations

import importlib
from typing import Any

from knotwork.errors import InputError


def import_package(module: str, purpose: str, how: str) -> Any:
    """Import a module that Knotwork does not depend on.

    Args:
        module: Name of the module.
        purpose: Purpose, for the error.
        how: Advice on its installation.

    Raises:
        InputError: The module can't be imported.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise InputError(
            f"{purpose} needs the package {package!r}, which can't be imported ({error}): {how}"
        ) from error
