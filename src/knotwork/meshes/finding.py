"""Finding the mesh files that a URDF names."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path


def find_mesh(name: str, urdf: Path, package_paths: Sequence[Path] = ()) -> Path | None:
    """Find the file of a mesh: below the URDF's folders, the user's, or those that ROS looks in.

    Args:
        name: As the URDF gives it: a path, a `file://`, `package://` or `model://` address.
        urdf: Path of the URDF.
        package_paths: The user's folders: of packages, or with files that relative paths name.

    Returns:
        The file, or `None` if there is none.
    """
    scheme, _, rest = name.partition("://")
    listed = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    listed += [f"{prefix}/share" for prefix in prefixes if prefix]
    own = [*package_paths, *(Path(one) for one in listed if one)]
    if scheme not in ("package", "model"):
        places = [folder / name.removeprefix("file://") for folder in (urdf.parent, *own)]
        return next(filter(_is_file, places), None)
    package, _, inside = rest.partition("/")
    above = urdf.resolve().parents
    places = [folder / rest for folder in (*package_paths, *above, *own)]
    places += [folder / inside for folder in (*own, *above) if folder.resolve().name == package]
    return next(filter(_is_file, places), None)


def mesh_package(mesh: Path) -> Path:
    """Folder of a mesh's package, the nearest with a `package.xml`, or else the mesh's own folder.

    The name in the URDF does not count: it could make any folder above the mesh a package.
    """
    mesh = mesh.resolve()
    packages = (folder for folder in mesh.parents if (folder / "package.xml").is_file())
    return next(packages, mesh.parent)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no file can have
        return False
