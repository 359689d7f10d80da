"""`read_yaml`: a file by YAML 1.2, in which `on` and `off` are text and 3e6 is a number."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ruamel.yaml import YAML


def read_yaml(path: Path) -> Any:
    return YAML(typ="safe", pure=True).load(path)
