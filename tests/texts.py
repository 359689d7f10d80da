"""Texts and data put into files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import yaml


def written(path: Path, content: Any) -> Path:
    """Write a text or bytes to a file, or plain data as JSON or YAML; its folder is made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not isinstance(content, str | bytes):
        dump = json.dumps if path.suffix == ".json" else yaml.safe_dump
        content = dump(content, **({} if dump is json.dumps else {"sort_keys": False}))
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path
