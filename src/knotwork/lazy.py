"""Public names of a package that are loaded from their modules when they are first used."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable
from typing import Any

_IMPORT = re.compile(r"^ *from ([\w.]+) import \(?\s*(\w+) as \2\b", re.MULTILINE)


def lazy_names(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Make `__getattr__`, `__dir__` and `__all__` of a package from its own import statements.

    Each public name is written once, as `from module import X as X`. What stands under
    `if TYPE_CHECKING:`, where type checkers find it, is loaded when it is first used.

    Args:
        package: Full name of the package.
    """
    module: Any = sys.modules[package]
    source = module.__spec__.loader.get_source(package)
    homes = {name: home for home, name in _IMPORT.findall(source)}

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if homes[name] == package:
            return importlib.import_module(f"{package}.{name}")
        value = getattr(importlib.import_module(homes[name]), name)
        setattr(module, name, value)
        return value

    public = sorted(name for name, home in homes.items() if home != package)
    return load, lambda: sorted({*public, *(n for n in vars(module) if n[:2] == "__")}), public
