"""Finding the mesh files that a URDF names."""

from __future__ import annotations

import os
from pathlib import Path


def find_mesh(name: str, urdf: Path) -> Path | None:
    """Find the file of a mesh: below the URDF's folders, or those that ROS looks in.

    Args:
        name: As the URDF gives it: a path, a `file://`, `package://` or `model://` address.
        urdf: Path of the URDF.

    Returns:
        The file, or `None` if there is none.
    """
    scheme, _, rest = name.partition("://")
    if scheme not in ("package", "model"):
        path = urdf.parent / name.removeprefix("file://")
        return path if path.is_file() else None
    package, _, inside = rest.partition("/")
    above = urdf.resolve().parents
    listed = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    listed += [f"{prefix}/share" for prefix in prefixes if prefix]
    places = [folder / rest for folder in (*above, *(Path(one) for one in listed if one))]
    places += [folder / inside for folder in above if folder.name == package]
    return next((path for path in places if path.is_file()), None)
