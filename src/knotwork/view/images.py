"""The images on a robot's meshes, made small enough to be parts of a page."""

from __future__ import annotations

import base64
import io
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from knotwork.errors import InputError

# Longest side of an image [pixels]; the first at which all images together are small enough.
SIDES = (1024, 512, 256, 128)
MOST_BYTES = 6_000_000
"""Size of all images of a page together, in base64."""
MOST_PIXELS = 2**26
"""Of one image that is read."""
MOST_PIXELS_TOGETHER = 2**29
# Others run programs, or are none that materials of meshes are made of.
FORMATS = ("PNG", "JPEG", "BMP", "GIF", "TGA", "TIFF", "WEBP")


def image_addresses(paths: Sequence[Path]) -> tuple[list[str | None], list[str]]:
    """Read images and give them as addresses that hold them whole.

    Args:
        paths: Their files.

    Returns:
        For each its address, `None` where it can't be read, and what could not be read and why.
    """
    unread: list[str] = []
    images: list[Any] = []
    left = MOST_PIXELS_TOGETHER
    for path in paths:
        try:
            image, pixels = _small_image(path, left)
            left -= pixels
            images.append(image)
        except Exception as error:  # Pillow raises whatever comes of a broken file
            reason = f"image {path} can't be read: {error}"
            unread.append(f"{reason}; what it colours is drawn grey")
            images.append(None)
    addresses: list[str | None] = []
    for side in SIDES:
        addresses = [None if image is None else _address(image, side) for image in images]
        if sum(len(address or "") for address in addresses) <= MOST_BYTES:
            break
    return addresses, unread


def _small_image(path: Path, left: int) -> tuple[Any, int]:
    """Read an image, at most as large as pages show it, and count the pixels of the file.

    Raises:
        InputError: It has more pixels than are read, alone or with the other images.
    """
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        opened = Image.open(path, formats=FORMATS)
    with opened:
        pixels = opened.width * opened.height
        if pixels > MOST_PIXELS:
            raise InputError(f"it has {pixels} pixels; at most {MOST_PIXELS} are read")
        if pixels > left:
            most = MOST_PIXELS_TOGETHER
            raise InputError(f"it has {pixels} pixels; of all images at most {most} are read")
        clear = "A" in opened.getbands() or "transparency" in opened.info
        mode = "RGBA" if clear else "RGB"
        opened.load()
        image = opened if opened.mode == mode else opened.convert(mode)
        image.thumbnail((SIDES[0], SIDES[0]))
        return image.copy(), pixels


def _address(image: Any, side: int) -> str:
    """An image, with sides no longer than asked for, as an address."""
    file = io.BytesIO()
    small = image.copy()
    small.thumbnail((side, side))
    kind = "png" if image.mode == "RGBA" else "jpeg"
    small.save(file, format=kind, quality=85)
    return f"data:image/{kind};base64,{base64.b64encode(file.getvalue()).decode('ascii')}"
