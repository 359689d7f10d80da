"""Mesh files named in a URDF, in the folders permitted for them.

URDFs are untrusted. A mesh must be in the URDF's own package or folder, in a folder named by the
user, or in one of ROS. This also holds for absolute paths, `..` and links.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path

from knotwork.errors import InputError, format_value


def find_mesh(name: str, urdf: Path, package_paths: tuple[Path, ...] = ()) -> Path:
    """Find the file of a mesh: below the URDF's folders, the user's, or those of ROS.

    No other folder is searched. A found file is cached as long as it exists.

    Args:
        name: Address in the URDF: a path, `file://`, `package://` or `model://`.
        urdf: Path of the URDF.
        package_paths: Folders of the user: package folders, or base folders of relative paths.

    Returns:
        The file.

    Raises:
        InputError: The file is not in the permitted folders.
    """
    folders = tuple(folder.absolute() for folder in package_paths)
    search = name, urdf.absolute(), folders, _list_ros_folders()
    file = _find_mesh(*search)
    return file if file.is_file() else _find_mesh.__wrapped__(*search)


@lru_cache(maxsize=1024)
def _find_mesh(
    name: str, urdf: Path, package_paths: tuple[Path, ...], ros: tuple[Path, ...]
) -> Path:
    allowed = [*_find_own_folders(urdf), *map(_resolve, (*package_paths, *ros))]
    scheme, _, address = name.partition("://")
    if scheme in ("package", "model"):
        allowed += _find_linked_folders(address.partition("/")[0], ros)
        candidates = _list_candidates(address, urdf, package_paths, ros)
        files = ((folder / inside, folder) for folder, inside in candidates)
    else:
        path = name.removeprefix("file://")
        files = ((folder / path, folder) for folder in (urdf.parent, *package_paths, *ros))
    for file, folder in files:
        if _is_below(file, allowed) and _is_file(file) and _is_below(folder, allowed):
            return file
    folders = ", ".join(dict.fromkeys(str(folder) for folder in allowed if folder))
    raise InputError(
        f"there is no mesh {format_value(name)} below {folders}; package_paths (--package-path) "
        "adds a folder"
    )


def _find_package_folder(folder: Path) -> Path:
    """Find the folder of a package: the nearest one with a `package.xml`, or the folder itself.

    The package name in the URDF is ignored, because it could make any folder above a package.
    """
    above = (folder, *folder.parents)
    return next((parent for parent in above if (parent / "package.xml").is_file()), folder)


def _find_own_folders(urdf: Path) -> list[Path]:
    """Find the package or folder of a URDF and, if it is a link, that of its target."""
    return [
        _find_package_folder(urdf.parent.resolve()),
        _find_package_folder(urdf.resolve().parent),
    ]


def _list_ros_folders() -> tuple[Path, ...]:
    """List the folders of ROS packages, from the environment."""
    listed = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    listed += [f"{prefix}/share" for prefix in prefixes if prefix]
    return tuple(Path(path) for path in listed if path)


def _list_candidates(
    rest: str, urdf: Path, package_paths: Sequence[Path], ros: Sequence[Path]
) -> Iterator[tuple[Path, str]]:
    """List candidate folders for a package address, each with the path in it."""
    package, _, inside = rest.partition("/")
    above = urdf.resolve().parents
    for folder in (*package_paths, *above, *ros):
        yield folder / package, inside
    for folder in (*package_paths, *ros, *above):
        if folder.resolve().name == package:
            yield folder, inside
    # a copy of a package under another name, as with `git clone`
    yield from ((folder, inside) for folder in package_paths)


def _find_linked_folders(package: str, ros: Sequence[Path]) -> Iterator[Path]:
    """Find folders of a ROS package whose files are links, as `colcon` installs them."""
    if package in ("", ".", ".."):
        return
    for folder in ros:
        file = _resolve(folder / package / "package.xml")
        if file and _is_file(file):
            yield file.parent


def _is_below(path: Path, folders: Sequence[Path | None]) -> bool:
    real = _resolve(path)
    return real is not None and any(real.is_relative_to(folder) for folder in folders if folder)


def _resolve(path: Path) -> Path | None:
    """Resolve a path; `None` if no file can have its name."""
    try:
        return Path(os.path.realpath(path))
    except (OSError, ValueError):
        return None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # no file can have this name
        return False
