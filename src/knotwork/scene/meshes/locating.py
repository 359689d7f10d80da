"""Mesh files named in a URDF, in the folders permitted for them.

URDFs are untrusted. A mesh must be in the URDF's own package or folder, in a folder named by the
user, or in one of ROS. This also holds for absolute paths, `..` and links.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from knotwork.errors import InputError, format_value


def find_mesh(
    name: str,
    urdf: Path,
    package_paths: Sequence[Path] = (),
    ros: Sequence[Path] | None = None,
) -> Path:
    """Find the file of a mesh: below the URDF's folders, the user's, or those of ROS.

    No other folder is searched.

    Args:
        name: Address in the URDF: a path, `file://`, `package://` or `model://`.
        urdf: Path of the URDF.
        package_paths: Folders of the user: package folders, or base folders of relative paths.
        ros: Folders of ROS; by default those of `ros_folders`.

    Returns:
        The file.

    Raises:
        InputError: The file is not in the permitted folders.
    """
    ros = ros_folders() if ros is None else ros
    allowed = [*_own_folders(urdf), *map(_real, (*package_paths, *ros))]
    scheme, _, address = name.partition("://")
    if scheme in ("package", "model"):
        allowed += _linked_folders(address.partition("/")[0], ros)

    if scheme in ("package", "model"):
        candidates = _in_packages(address, urdf, package_paths, ros)
        files = [(folder / inside, folder) for folder, inside in candidates]
    else:
        path = name.removeprefix("file://")
        files = [(folder / path, folder) for folder in (urdf.parent, *package_paths, *ros)]
    for file, folder in files:
        if _below(file, allowed) and _is_file(file) and _below(folder, allowed):
            return file
    folders = ", ".join(dict.fromkeys(str(folder) for folder in allowed if folder))
    raise InputError(
        f"there is no mesh {format_value(name)} below {folders} (`package_paths` or --package-path "
        "adds a folder)"
    )


def _package(folder: Path) -> Path:
    """Folder of a package: the nearest one with a `package.xml`, or the folder itself.

    The package name in the URDF is ignored, because it could make any folder above a package.
    """
    above = (folder, *folder.parents)
    return next((parent for parent in above if (parent / "package.xml").is_file()), folder)


def _own_folders(urdf: Path) -> list[Path]:
    """The URDF's package or folder: its own one, and that of the target of a link."""
    return [_package(urdf.parent.resolve()), _package(urdf.resolve().parent)]


def ros_folders() -> tuple[Path, ...]:
    """Folders of ROS packages, from the present environment."""
    listed = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    listed += [f"{prefix}/share" for prefix in prefixes if prefix]
    return tuple(Path(path) for path in listed if path)


def _in_packages(
    rest: str, urdf: Path, package_paths: Sequence[Path], ros: Sequence[Path]
) -> Iterator[tuple[Path, str]]:
    """Candidate folders of the package of an address, and the path in them."""
    package, _, inside = rest.partition("/")
    above = urdf.resolve().parents
    for folder in (*package_paths, *above, *ros):
        yield folder / package, inside
    for folder in (*package_paths, *ros, *above):
        if folder.resolve().name == package:
            yield folder, inside
    # a copy of a package under another name, as with `git clone`
    yield from ((folder, inside) for folder in package_paths)


def _linked_folders(package: str, ros: Sequence[Path]) -> Iterator[Path]:
    """Folder of a ROS package whose files are links, as installed by `colcon`."""
    if package in ("", ".", ".."):
        return
    for folder in ros:
        file = _real(folder / package / "package.xml")
        if file and _is_file(file):
            yield file.parent


def _below(path: Path, folders: Sequence[Path | None]) -> bool:
    real = _real(path)
    return real is not None and any(real.is_relative_to(folder) for folder in folders if folder)


def _real(path: Path) -> Path | None:
    """Resolved path; `None` if no file can have its name."""
    try:
        return Path(os.path.realpath(path))
    except (OSError, ValueError):
        return None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # no file can have this name
        return False
