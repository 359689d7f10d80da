"""Pairs of links that an SRDF excludes from collision checks."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from knotwork.errors import DocumentError, InputError
from knotwork.files.documents import parse_xml, read_text
from knotwork.robot.urdf import MAX_URDF_BYTES, MAX_URDF_ELEMENTS
from knotwork.robot.urdf_rules import child_elements


@lru_cache(maxsize=32)
def disabled_pairs(path: Path, changed: int) -> tuple[tuple[str, str, str], ...]:
    """Read two links and the reason of each excluded pair.

    Args:
        path: The SRDF.
        changed: Time of its last change, the key of the cache.

    Raises:
        InputError: The file can't be read, or is not an SRDF.
    """
    try:
        text = read_text(path, most=MAX_URDF_BYTES)
        root = parse_xml(text.encode(), MAX_URDF_ELEMENTS).documentElement
    except DocumentError:
        raise
    except InputError as error:
        raise InputError(f"{path} is not an SRDF: {error}") from error
    if root is None or root.tagName != "robot":
        raise InputError(f"{path} is not an SRDF: its outermost element is not <robot>")
    return tuple(
        (
            element.getAttribute("link1"),
            element.getAttribute("link2"),
            element.getAttribute("reason").lower(),
        )
        for element in child_elements(root, "disable_collisions")
    )
