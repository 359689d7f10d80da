"""The images on a robot's meshes, made small enough to be parts of a page."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path

# Longest side of an image [pixels]; the first at which all images together are small enough.
SIDES = (1024, 512, 256, 128)
MOST_BYTES = 6_000_000
"""Size of all images of a page together, in base64."""


def image_addresses(paths: Sequence[Path]) -> tuple[list[str | None], list[str]]:
    """Read images and give them as addresses that hold them whole.

    Args:
        paths: Their files.

    Returns:
        For each its address, `None` where it can't be read, and what could not be read and why.
    """
    warnings: list[str] = []
    addresses: list[str | None] = []
    for side in SIDES:
        warnings.clear()
        addresses = [_address(path, side, warnings) for path in paths]
        if sum(len(address or "") for address in addresses) <= MOST_BYTES:
            break
    return addresses, warnings


def _address(path: Path, side: int, warnings: list[str]) -> str | None:
    from PIL import Image

    file = io.BytesIO()
    try:
        with Image.open(path) as opened:
            clear = "A" in opened.getbands() or "transparency" in opened.info
            image = opened.convert("RGBA" if clear else "RGB")
        image.thumbnail((side, side))
        kind = "png" if clear else "jpeg"
        image.save(file, format=kind, quality=85)
    except (OSError, ValueError, Image.DecompressionBombError) as error:
        warnings.append(f"image {path} can't be read: {error}; what it colours is drawn grey")
        return None
    return f"data:image/{kind};base64,{base64.b64encode(file.getvalue()).decode('ascii')}"
