"""The images on a robot's meshes, reduced to fit into a page."""

from __future__ import annotations

import base64
import io
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from knotwork.errors import InputError

# Longest side of an image [pixels]; the first one at which all images together are small enough.
SIDES = (1024, 512, 256, 128)
MOST_BYTES = 6_000_000
"""Largest size of all images of a page together, in base64."""
MOST_PIXELS = 2**26
"""Largest number of pixels of an image."""
MOST_PIXELS_TOGETHER = 2**29
# Other formats run programs, or are not used for materials of meshes.
FORMATS = ("PNG", "JPEG", "BMP", "GIF", "TGA", "TIFF", "WEBP")


def image_addresses(paths: Sequence[Path]) -> tuple[list[str | None], list[str]]:
    """Read images as data addresses.

    Args:
        paths: Their files.

    Returns:
        For each its address, or `None` if unreadable; and the unreadable ones with reasons.
    """
    unread: list[str] = []
    images: list[Any] = []
    left = MOST_PIXELS_TOGETHER
    for path in paths:
        try:
            image, pixels = _small_image(path, left)
            left -= pixels
            images.append(image)
        except Exception as error:  # Pillow raises any error for a broken file
            reason = f"image {path} can't be read: {error}"
            unread.append(f"{reason}; its surfaces are drawn grey")
            images.append(None)
    addresses: list[str | None] = []
    for side in SIDES:
        addresses = [None if image is None else _address(image, side) for image in images]
        if sum(len(address or "") for address in addresses) <= MOST_BYTES:
            break
    return addresses, unread


def _small_image(path: Path, left: int) -> tuple[Any, int]:
    """Read an image, reduced to the size of pages, and count the pixels of the file.

    Raises:
        InputError: The image has too many pixels, alone or with the other images.
    """
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        opened = Image.open(path, formats=FORMATS)
    with opened:
        pixels = opened.width * opened.height
        if pixels > MOST_PIXELS:
            raise InputError(f"it has {pixels} pixels; at most {MOST_PIXELS} are accepted")
        if pixels > left:
            most = MOST_PIXELS_TOGETHER
            raise InputError(f"it has {pixels} pixels; at most {most} are accepted for all images")
        clear = "A" in opened.getbands() or "transparency" in opened.info
        mode = "RGBA" if clear else "RGB"
        opened.load()
        image = opened if opened.mode == mode else opened.convert(mode)
        image.thumbnail((SIDES[0], SIDES[0]))
        return image.copy(), pixels


def _address(image: Any, side: int) -> str:
    """An image, with limited sides, as an address."""
    file = io.BytesIO()
    small = image.copy()
    small.thumbnail((side, side))
    kind = "png" if image.mode == "RGBA" else "jpeg"
    small.save(file, format=kind, quality=85)
    return f"data:image/{kind};base64,{base64.b64encode(file.getvalue()).decode('ascii')}"
