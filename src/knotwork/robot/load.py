"""Loading of robots: shipped ones by name, others by file or inline."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from knotwork.errors import InputError, RobotError, UnknownNameError
from knotwork.errors.arguments import require_type
from knotwork.files.documents import Document, read, resources, validate
from knotwork.robot.external_axes import Axes
from knotwork.robot.robot import Robot
from knotwork.robot.robot_file import RobotFile
from knotwork.robot.robot_spec import RobotSpec, limits_by_joint
from knotwork.robot.urdf import Urdf, read_urdf

EXAMPLE_ROBOT_DATA = "example-robot-data:"
_SUFFIXES = (".yaml", ".yml", ".json", "")
_DATA_FOLDER = "share/example-robot-data/robots"
_IN_PACKAGE = re.compile(r"([A-Za-z_]\w+):(.+)")
"""A file of an installed Python package, such as `airo_models:arms/ur5e/ur5e.urdf`. One letter is a
drive.
"""
_SHIPPED_MODEL = re.compile(r"^urdf: (\w+):", re.MULTILINE)
_INSTALLED_AS = {"airo_models": "airo-models", "rtbdata": "rtb-data"}


def robot_names() -> list[str]:
    """Names of the shipped robots whose models are installed, sorted.

    >>> "ur5" in kw.robot_names()
    True
    """
    missing = {name for _, group in robots_of_missing_packages() for name in group}
    return [name for name in resources.names("robots") if name not in missing]


def robots_of_missing_packages() -> list[tuple[str, list[str]]]:
    """Missing packages by their name for `pip`, each with the shipped robots that need it."""
    robots: dict[str, list[str]] = {}
    for name in resources.names("robots"):
        text = (resources.folder("robots") / f"{name}.yaml").read_text(encoding="utf-8")
        match = _SHIPPED_MODEL.search(text)
        if match and _find_module_folder(match[1]) is None:
            robots.setdefault(_INSTALLED_AS.get(match[1], match[1]), []).append(name)
    return sorted(robots.items())


def load_robot(
    reference: str | Path | Document | Mapping[str, Any], *, relative_to: Path | None = None
) -> Robot:
    """Load a robot.

    Args:
        reference: The name of a shipped robot, the path of a robot's YAML file or of a URDF, or a
            description in place. A description has the keys of a robot's YAML file. It is a mapping
            or a part of a document.
        relative_to: Base folder of relative paths; by default that of the document, or the
            working directory.

    Raises:
        UnknownNameError: A name of a robot, joint or frame is unknown.
        InputError: No file exists at the path.
        DocumentError: A file can't be read, or a value in it is wrong.
        RobotError: The URDF is invalid, the base frame does not carry the tool frame, no joint
            moves the tool frame, a joint that moves it is not supported, or a configuration is
            incomplete or outside the position limits.

    >>> load_robot("planar2").joint_names
    ('shoulder', 'elbow')
    """
    if isinstance(reference, Document):
        folder = reference.file.parent if reference.file is not None else None
        return _load_document(reference, relative_to or folder or Path())
    if isinstance(reference, Mapping):
        return _load_document(Document(dict(reference)), relative_to or Path())
    require_type(reference, str | Path, "robot", "a name, path or mapping")
    path = _find_file(reference, relative_to)
    if path.suffix not in _SUFFIXES:
        name = path.stem
        return Robot(RobotSpec(name=name, source=path, urdf=read_urdf(path, name)))
    return _load_document(read(path), path.parent)


def _find_file(reference: str | Path, relative_to: Path | None) -> Path:
    text = str(reference)
    if text.startswith(EXAMPLE_ROBOT_DATA):
        return _require_file(text, Path(), text, "URDF")
    if relative_to is not None and resources.is_path(reference):
        reference = relative_to / os.path.expanduser(reference)
    return resources.find("robots", reference)


def _load_document(document: Document, folder: Path) -> Robot:
    content = validate(RobotFile, document)
    name = content.name
    if name is None:
        whole_file = document.file is not None and not document.prefix
        name = document.file.stem if whole_file and document.file else Path(content.urdf).stem
    path = _require_file(content.urdf, folder, name, "URDF")
    urdf = read_urdf(path, name, _resolve_axes(content, document, folder, name))
    _check_names(content, document, urdf)
    srdf = content.collision.srdf
    robot = Robot(
        RobotSpec(
            name=name,
            description=content.description,
            source=document.file or path,
            urdf=urdf,
            base_frame=content.base_frame,
            tool_frame=content.tool_frame,
            locked=content.locked,
            configurations=content.configurations,
            limits=limits_by_joint(content.limits, urdf),
            package_paths=tuple(
                _resolve_path(folder_name, folder, name) for folder_name in content.package_paths
            ),
            ignored_pairs=tuple((pair[0], pair[1]) for pair in content.collision.ignore),
            srdf=None if srdf is None else _require_file(srdf, folder, name, "SRDF"),
        )
    )
    if robot.tool_frame is not None:
        for configuration in content.configurations:
            with document.errors_at("configurations", configuration):
                _check_configuration(robot, configuration)
    return robot


def _resolve_axes(content: RobotFile, document: Document, folder: Path, robot_name: str) -> Axes:
    """Resolve the paths of the URDFs of external axes."""
    axes = []
    for name, axis in content.external_axes.items():
        if axis.urdf is not None:
            try:
                path = _require_file(axis.urdf, folder, robot_name, "URDF")
            except InputError as error:
                error.locate(document.where(("external_axes", name, "urdf")))
                raise
            axis = axis.model_copy(update={"urdf": str(path)})
        axes.append((name, axis))
    return tuple(axes)


def _check_names(content: RobotFile, document: Document, urdf: Urdf) -> None:
    """Check that named joints and links exist."""
    for field in ("base_frame", "tool_frame"):
        link = getattr(content, field)
        if link is not None and link not in urdf.links:
            raise UnknownNameError("link", link, urdf.links, where=document.where((field,)))
    for i, pair in enumerate(content.collision.ignore):
        for link in pair:
            if link not in urdf.links:
                where = document.where(("collision", "ignore", i))
                raise UnknownNameError("link", link, urdf.links, where=where)
    joints = [name for name in urdf.model.names if name != "universe"]
    tables: list[tuple[tuple[str, ...], Mapping[str, Any]]] = [(("locked",), content.locked)]
    tables += [(("configurations", k), v) for k, v in content.configurations.items()]
    tables += [
        (("limits", kind), table) for kind, table in content.limits if isinstance(table, Mapping)
    ]
    for field_path, table in tables:
        for joint in table:
            if joint not in joints:
                where = document.where((*field_path, joint))
                raise UnknownNameError("joint", joint, joints, where=where)


def _check_configuration(robot: Robot, name: str) -> None:
    q = robot.configuration(name)
    lower_limits, upper_limits = robot.limits.lower, robot.limits.upper
    joints = zip(robot.joint_names, q, lower_limits, upper_limits, robot.joint_units, strict=True)
    for joint, value, lower, upper, unit in joints:
        if not lower <= value <= upper:
            raise RobotError(
                robot.name,
                f"configuration {name!r} has joint {joint!r} at {value:g}, outside its limits "
                f"[{lower:g}, {upper:g}] {unit}",
                joint=joint,
            )


def _require_file(reference: str, folder: Path, robot_name: str, kind: str) -> Path:
    """Find the file of a reference, and check that it exists; `kind` is `"URDF"` or `"SRDF"`."""
    path = _resolve_path(reference, folder, robot_name)
    if not os.path.isfile(path):
        raise RobotError(robot_name, f"there is no {kind} file {path}")
    return path


def _resolve_path(reference: str, folder: Path, robot_name: str) -> Path:
    """Find the path of a reference, relative to a folder or in an installed Python package."""
    if reference.startswith(EXAMPLE_ROBOT_DATA):
        inside = reference.removeprefix(EXAMPLE_ROBOT_DATA).lstrip("/")
        return find_example_robot_data(robot_name) / inside
    path = folder / os.path.expanduser(reference)
    match = _IN_PACKAGE.fullmatch(reference)
    if match is None or path.exists():
        return path
    module = _find_module_folder(match[1])
    if module is None:
        name = _INSTALLED_AS.get(match[1], match[1])
        raise RobotError(
            robot_name,
            f"{reference} is in the Python package {match[1]!r}, which is not installed; install "
            f"it with `pip install {name}`",
        )
    return module / match[2].lstrip("/")


def _find_module_folder(module: str) -> Path | None:
    """Find the folder of an installed Python package, without importing it."""
    return next((path for folder in sys.path if (path := Path(folder) / module).is_dir()), None)


def find_example_robot_data(robot_name: str) -> Path:
    """Find the folder `robots` of the package example-robot-data, without importing it.

    Raises:
        RobotError: The package is not installed.
    """
    # Searching the metadata of installed packages would take longer than loading the robot.
    folder = _find_module_folder(f"cmeel.prefix/{_DATA_FOLDER}") or Path(sys.prefix) / _DATA_FOLDER
    if folder.is_dir():  # the second place is that of conda
        return folder
    raise RobotError(
        robot_name,
        "its URDF comes with the package example-robot-data, which is not installed; install it "
        'with `pip install "example-robot-data>=5.0,<6"`',
    )
