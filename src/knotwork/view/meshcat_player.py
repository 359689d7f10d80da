"""A scene in a running Meshcat viewer: robot, path, frames, surroundings, motion."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.errors import InputError
from knotwork.view.mesh import Mesh
from knotwork.view.scene_parts import unpack_mesh, unpack_numbers

if TYPE_CHECKING:
    from meshcat import Visualizer

ROOT = "knotwork"
ANIMATION_RATE = 60.0
"""Frames per second of the animation; Meshcat interpolates between them."""
VIEW_ANGLE = 45.0
"""Vertical field of view [deg]."""
BOARD_WIDTH, BOARD_HEIGHT = 6.4, 3.2
"""Size of the board's picture [in]."""
MAX_BOARD_LINES = 5
"""Maximum number of lines for failures on the board."""
LINE_LETTERS = 74
"""Number of letters in a line of the board."""
VERDICT_LOOKS = {True: ("passed", "#12803c"), False: ("FAILED", "#c01018"), None: ("", "black")}


def play_scene(scene: Mapping[str, Any], viewer: Any) -> None:
    """Draw a scene in a Meshcat viewer below `knotwork`, set the camera, and start its motion.

    This replaces the drawing of an earlier call. Other objects in the viewer stay. The robot of
    Pinocchio's `MeshcatVisualizer` is hidden; `displayVisuals(True)` shows it again.

    Args:
        scene: From `make_scene`.
        viewer: A `meshcat.Visualizer`, or Pinocchio's `MeshcatVisualizer`.

    Raises:
        InputError: The viewer is neither, or not started.
    """
    inner = _visualizer(viewer)
    root = inner[ROOT]
    root.delete()
    joints = _joint_nodes(scene, root)
    for carrier, parts in enumerate(scene["shapes"]):
        for number, part in enumerate(parts):
            _draw(joints[carrier][f"shape {number}"], unpack_mesh(part), lit=True)
    nodes = []
    for number, part in enumerate(scene["meshes"]):
        carrier = joints[part["carrier"]] if "carrier" in part else root
        node = carrier[_path_element(f"{part['name']} {number}")]
        _draw(node, unpack_mesh(part["mesh"]), lit=part["lit"])
        if part["hidden"]:
            node.set_property("visible", False)
        nodes.append(node)
    look_at(scene, inner, put_up_board(scene, root["board"]))
    root.set_animation(_animation(scene, joints, nodes))


def look_at(scene: Mapping[str, Any], viewer: Visualizer, board: FloatArray) -> None:
    """Turn the camera of a `meshcat.Visualizer` to a scene and its board's corners (4, 3).

    Meshcat's camera looks at the origin; it is so far away that all points are in view.
    """
    points = np.concatenate([scene["view"]["points"], board])
    far = float(np.linalg.norm(points, axis=1).max()) / np.sin(np.radians(VIEW_ANGLE) / 2.0)
    x, y, z = (far * float(part) for part in scene["view"]["towards_camera"])
    viewer["/Cameras/default"].set_transform(np.eye(4))
    eye = viewer["/Cameras/default/rotated/<object>"]
    eye.set_property("fov", VIEW_ANGLE)
    eye.set_property("position", [x, z, -y])


def _visualizer(viewer: Any) -> Visualizer:
    """The `meshcat.Visualizer` of either kind of viewer."""
    inner = viewer
    if hasattr(viewer, "displayVisuals"):
        inner = getattr(viewer, "viewer", None)
        if inner is None:
            raise InputError("the MeshcatVisualizer has no viewer yet; call its initViewer() first")
        if hasattr(viewer, "viewerVisualGroupName"):
            viewer.displayVisuals(False)
    if not all(hasattr(inner, name) for name in ("set_object", "set_animation", "window")):
        raise InputError(
            f"can't play in {type(viewer).__name__}; accepted: a meshcat.Visualizer or Pinocchio's "
            "MeshcatVisualizer"
        )
    return inner


def _joint_nodes(scene: Mapping[str, Any], root: Visualizer) -> list[Visualizer]:
    """Nodes of the viewer, one per joint, after that of the fixed parts."""
    nodes = [root["arm"]]
    for joint in scene["joints"]:
        nodes.append(nodes[joint["parent"]][_path_element(joint["name"])])
    return nodes


def _path_element(name: str) -> str:
    """A name as one element of a Meshcat path."""
    return name.replace("/", "|")


def _draw(node: Visualizer, mesh: Mesh, *, lit: bool) -> None:
    from meshcat.geometry import MeshBasicMaterial, MeshPhongMaterial, TriangularMeshGeometry

    make = MeshPhongMaterial if lit else MeshBasicMaterial
    look = make(
        color=0xFFFFFF,
        vertexColors=True,
        opacity=mesh.opacity,
        transparent=mesh.opacity < 1.0,
    )
    node.set_object(TriangularMeshGeometry(mesh.vertices, mesh.faces, mesh.colours), look)


def _animation(scene: Mapping[str, Any], joints: list[Visualizer], nodes: list[Visualizer]) -> Any:
    from meshcat.animation import Animation, AnimationClip

    arm = scene["arm"]
    time = unpack_numbers(arm["time"], "<f4").astype(float)
    position = unpack_numbers(arm["position"], "<f4").astype(float).reshape(len(time), -1)
    last = np.flatnonzero(np.diff(np.floor(ANIMATION_RATE * time + 1e-3), append=np.inf))
    frames = np.unique([0, *last, len(time) - 1])
    at = (ANIMATION_RATE * time[frames]).tolist()
    animation = Animation(default_framerate=ANIMATION_RATE)

    def add(node: Visualizer, tracks: dict[str, Any]) -> None:
        animation.clips[node.path] = AnimationClip(tracks=tracks, fps=ANIMATION_RATE)

    for joint, node, column in zip(scene["joints"], joints[1:], position[frames].T, strict=True):
        add(node, _joint_poses(joint, column, at))
    for part, node in zip(scene["meshes"], nodes, strict=True):
        if part.get("between") is not None:
            add(node, _presence(part["between"], at[-1]))
    return animation


def _joint_poses(joint: Mapping[str, Any], q: FloatArray, at: list[float]) -> dict[str, Any]:
    """Poses of a joint over time, in its parent's axes."""
    from meshcat.animation import AnimationTrack
    from scipy.spatial.transform import Rotation

    placed, slides = Rotation.from_quat(joint["quaternion"]), joint["slides"]
    along = np.outer(q, joint["axis"])
    positions = joint["origin"] + slides * placed.apply(along)
    turns = (placed * Rotation.from_rotvec((not slides) * along)).as_quat()
    opposite = (turns[1:] * turns[:-1]).sum(axis=1) < 0.0  # this avoids the longer rotation
    turns[1:] *= np.cumprod(np.where(opposite, -1.0, 1.0))[:, np.newaxis]
    return {
        "position": AnimationTrack("position", "vector3", at, positions.tolist()),
        "quaternion": AnimationTrack("quaternion", "quaternion", at, turns.tolist()),
    }


def _presence(between: tuple[float | None, float | None], end: float) -> dict[str, Any]:
    """Visibility of an object with a limited presence."""
    from meshcat.animation import AnimationTrack

    first, last = between
    changes: dict[float, bool] = {0.0: not first, end: last is None}
    if first:
        changes[min(ANIMATION_RATE * first, end)] = True
    if last is not None:
        changes[min(ANIMATION_RATE * last, end)] = False
    at = sorted(changes)
    return {"visible": AnimationTrack("visible", "bool", at, [changes[time] for time in at])}


def put_up_board(scene: Mapping[str, Any], node: Visualizer) -> FloatArray:
    """Place a board at the left of a scene, facing the first view.

    Args:
        scene: From `make_scene`.
        node: Node of the viewer for the board.

    Returns:
        The corners of the board [m], shape (4, 3).
    """
    from meshcat.geometry import Box, ImageTexture, MeshBasicMaterial, PngImage

    points = np.array(scene["view"]["points"])
    low, high = points.min(axis=0), points.max(axis=0)
    size = float(np.linalg.norm(high - low))
    towards = np.array(scene["view"]["towards_camera"]) * (1.0, 1.0, 0.0)
    towards /= max(float(np.linalg.norm(towards)), 1e-9)
    up = np.array([0.0, 0.0, 1.0])
    right = np.cross(up, towards)
    middle = (low + high) / 2
    width, height = (0.55 * size * side / BOARD_WIDTH for side in (BOARD_WIDTH, BOARD_HEIGHT))
    aside = float(((points - middle) @ right).min()) - 0.5 * width - 0.05 * size
    pose = pin.SE3(np.column_stack([right, up, towards]), middle + aside * right)
    pose.translation[2] = high[2] - 0.5 * height
    picture = MeshBasicMaterial(map=ImageTexture(image=PngImage(drawn_board(scene))))
    node.set_object(Box([width, height, 1e-3 * size]), picture)
    node.set_transform(pose.homogeneous)
    corners = np.array([(i * width, j * height, 0.0) for i in (-0.5, 0.5) for j in (-0.5, 0.5)])
    return np.asarray(corners @ pose.rotation.T + pose.translation)


def board_lines(scene: Mapping[str, Any]) -> list[str]:
    """Lines of the board below its title: the summary, and failures with their remedies."""
    lines = [" · ".join(part for part in (scene["summary"], scene["duration"]) if part)]
    for failure in scene["failures"]:
        text = "; ".join(part for part in (failure["line"], failure["remedy"]) if part)
        lines += textwrap.wrap(text, LINE_LETTERS, initial_indent="• ", subsequent_indent="   ")
    return lines[: 1 + MAX_BOARD_LINES]


def drawn_board(scene: Mapping[str, Any]) -> bytes:
    """The board's picture, a PNG."""
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

    verdict, colour = VERDICT_LOOKS[scene["ok"]]
    figure = Figure(figsize=(BOARD_WIDTH, BOARD_HEIGHT), dpi=160, facecolor="white")
    figure.text(0.03, 0.9, f"{scene['title']}   {verdict}", size=15, weight="bold", color=colour)
    for i, line in enumerate(board_lines(scene)):
        figure.text(0.03, 0.82 - 0.075 * i, line, size=9.5, color=colour if i else "black")
    legend, units = scene["legend"], scene["units"]
    if legend.get("high"):
        axis = figure.add_axes((0.03, 0.09, 0.4, 0.07))
        shades = LinearSegmentedColormap.from_list("speed", legend["colours"])
        axis.imshow(np.linspace(0, 1, 200)[np.newaxis], cmap=shades, aspect="auto")
        axis.set_axis_off()
        high = f"{legend['high'] * units['per_metre']:.3g} {units['length']}/s"
        figure.text(0.03, 0.18, f"tool speed, 0 to {high}", size=9)
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()
