"""The images on a robot's meshes, reduced to fit into a page."""

from __future__ import annotations

import base64
import io
import warnings
from collections.abc import Sequence
from pathlib import Path

from knotwork.errors import InputError

LARGEST_SIDE, LEAST_SIDE = 1024, 128
"""Longest side of an image on a page of few images, and of very many [pixels]."""
FEW_IMAGES = 8
"""Number of images above which they become smaller, so that all together stay about as large."""
MOST_PIXELS = 2**26
"""Largest number of pixels of an image."""
# Other formats run programs, or are not used for materials of meshes.
IMAGE_FORMATS = ("PNG", "JPEG", "BMP", "GIF", "TGA", "TIFF", "WEBP")


def image_addresses(paths: Sequence[Path]) -> tuple[list[str | None], list[str]]:
    """Read images as data addresses.

    Args:
        paths: Their files.

    Returns:
        For each its address, or `None` if unreadable; and the unreadable ones with reasons.
    """
    unread: list[str] = []
    addresses: list[str | None] = []
    side = max(LEAST_SIDE, int(LARGEST_SIDE * min(1.0, FEW_IMAGES / max(len(paths), 1)) ** 0.5))
    for path in paths:
        try:
            addresses.append(_image_address(path, side))
        except Exception as error:  # Pillow raises any error for a broken file
            reason = f"image {path} can't be read: {error}"
            unread.append(f"{reason}; its surfaces are drawn grey")
            addresses.append(None)
    return addresses, unread


def _image_address(path: Path, side: int) -> str:
    """An image, with limited sides, as an address.

    Raises:
        InputError: The image has too many pixels.
    """
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        opened = Image.open(path, formats=IMAGE_FORMATS)
    with opened:
        pixels = opened.width * opened.height
        if pixels > MOST_PIXELS:
            raise InputError(f"it has {pixels} pixels; at most {MOST_PIXELS} are accepted")
        clear = "A" in opened.getbands() or "transparency" in opened.info
        image = opened.convert("RGBA" if clear else "RGB")
    image.thumbnail((side, side))
    file, kind = io.BytesIO(), "png" if clear else "jpeg"
    image.save(file, format=kind, quality=85)
    return f"data:image/{kind};base64,{base64.b64encode(file.getvalue()).decode('ascii')}"
