"""Content of a scene: arm, motion, task and findings of the check, as plain data.

Everything is in the axes of the URDF's root, z up, in m and s.
"""

from __future__ import annotations

import base64
import io
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from knotwork.errors import InputError
from knotwork.robot.joint_tree import joint_tree, place_joints
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.trajectory import JointTrajectory
from knotwork.verification import check
from knotwork.view.base_joints import base_joints, drawn_joints
from knotwork.view.camera import views
from knotwork.view.known_joints import draw_other_robots, joint_origins, known_joints
from knotwork.view.mesh import box_corners, coarse
from knotwork.view.path_meshes import asked_points, draw_paths
from knotwork.view.playback import arm_frames, joint_panel, waypoint_times
from knotwork.view.scene_parts import SceneParts, pack_mesh
from knotwork.view.scene_verdict import verdict
from knotwork.view.shown_motion import PlanLike, ShownMotion
from knotwork.view.surroundings import draw_surroundings
from knotwork.view.task_marks import draw_frames, draw_marks
from knotwork.view.time_strip import time_strip
from knotwork.waypoints import FloatArray

GHOST_DETAIL = 0.015
"""Size of the finest detail of faint copies of the arm, relative to the scene's size."""
ROBOT_PARTS = ("joints", "shapes", "images", "coarse")
"""Parts of a scene that depend only on the robot: most of the data."""


LARGEST_SIDE, LEAST_SIDE = 1024, 128
"""Longest side of an image on a page of few images, and of very many [pixels]."""
FEW_IMAGES = 8
"""Number of images above which they become smaller, so that all together stay about as large."""
MOST_PIXELS = 2**26
"""Largest number of pixels of an image."""
# Other formats run programs, or are not used for materials of meshes.
IMAGE_FORMATS = ("PNG", "JPEG", "BMP", "GIF", "TGA", "TIFF", "WEBP")
MOST_STOPS = 200
# Copies of the arm closer to each other than this, relative to the scene's size, hide each other.
LEAST_DISTANCE = 0.12
MOST_COPIES = 4
# Number of samples of the arm along the motion.
PASSED_SAMPLES = 40


def scene_of(
    plan: PlanLike,
    others: Mapping[str, JointTrajectory] | None = None,
    before: Mapping[str, Any] | None = None,
    fastest: float = 0.0,
) -> dict[str, Any]:
    """Compose the scene of a plan, as plain data; `before` as for `make_scene`.

    Colours of tool speeds go up to the `fastest` one at least [m/s].

    Raises:
        InputError: The scenario has no robot, or the motion can't be shown.
    """
    return make_scene(ShownMotion.of_plan(plan, fastest), others, before=before)


def make_scene(
    shown: ShownMotion,
    others: Mapping[str, JointTrajectory] | None = None,
    *,
    warnings: Sequence[str] = (),
    before: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Compose the scene of a motion, as plain data for JSON.

    Args:
        shown: The motion with the arm, its meshes, and the task.
        others: Motions of other planners by name, shown as translucent arms.
        warnings: Further warnings for the page.
        before: The replaced scene. For the same robot its `ROBOT_PARTS` are reused, as the same
            objects, and the view is kept.

    Raises:
        InputError: A trajectory has other joints than the robot, or is too long.
    """
    robot, compared = shown.robot, others or {}
    joints, owner = (robot.joint_names, robot.joint_units), f"robot {robot.name!r}"
    motions = {
        name: motion.reordered(*joints, owner=owner).polynomial for name, motion in compared.items()
    }
    stops, base = find_stops(shown), base_joints(robot)
    task = _at_start(shown, _task_points(shown))
    outlines = [corners.reshape(-1, 3) for corners in (stops.outlines, stops.passed)]
    points = np.concatenate([*outlines, task, _at_start(shown, _fixed_points(shown))])
    size = max(float(np.ptp(points, axis=0).max()), 1e-3)
    robot_parts, unread = _robot_parts(shown, size, before)
    same_robot = before is not None and robot_parts["joints"] is before["joints"]
    parts = SceneParts([*warnings, *shown.shapes.warnings])
    legend = draw_paths(parts, shown, motions, size)
    if shown.trace is not None:
        legend |= draw_marks(parts, shown, size)
        draw_frames(parts, shown, size)
    draw_surroundings(parts, shown, size)
    draw_other_robots(parts, shown, size)
    in_view = [points, *(_at_start(shown, corners) for corners in parts.corners)]
    return {
        **_description(shown),
        **robot_parts,
        **_arms(shown, motions, stops.position[stops.distinct(size)], len(robot_parts["joints"])),
        "things": base.carry(parts.things),
        "labels": base.carry(_merge_labels(parts.labels)),
        "waypoints": waypoint_times(shown),
        "strip": time_strip(shown),
        "legend": legend,
        "size": size,
        "floor": float(min(stops.outlines[..., 2].min(), 0.0)),
        **views(
            _extreme_points(np.concatenate(in_view)),
            task,
            _at_start(shown, joint_origins(shown)[1]),
            before["view"]["from"] if same_robot and before is not None else None,
        ),
        **verdict(shown.report, shown.scenario, robot, base.count),
        "others": [_failures(shown, name, motion) for name, motion in compared.items()],
        "warnings": [*parts.warnings, *unread],
    }


def _failures(shown: ShownMotion, name: str, motion: JointTrajectory) -> dict[str, Any]:
    """Name and failures of another motion for the same scenario."""
    report = check(motion, shown.scenario, space=shown.space)
    return {"name": name, "failures": list(map(str, report.failures))}


def _at_start(shown: ShownMotion, points: FloatArray) -> FloatArray:
    """Points carried by the base frame at the start of the motion, shape (n, 3)."""
    start = shown.curve(shown.curve.x[:1])
    return np.asarray(base_joints(shown.robot).to_world(start, points[None])[0])


def _task_points(shown: ShownMotion) -> FloatArray:
    """The tool's path and the waypoints [m], shape (n, 3)."""
    path = [] if shown.trace is None else [shown.trace.position]
    targets = [target.pose.translation[np.newaxis] for target in shown.targets]
    return np.concatenate([np.zeros((0, 3)), *path, *targets])


def _fixed_points(shown: ShownMotion) -> FloatArray:
    """Fixed points in the base frame [m], shape (n, 3)."""
    paths = asked_points(shown, 1.0, at_rest=True) if shown.trace is not None else ()
    base = shown.robot.base_placement
    frames = [(base * frame).translation for frame in shown.scenario.frames.values()]
    points = [joint_origins(shown)[0], np.reshape(frames, (-1, 3))]
    return np.concatenate([*(dash for _, dashes in paths for dash in dashes), *points])


def _arms(
    shown: ShownMotion, motions: Mapping[str, PiecewisePolynomial], copies: FloatArray, joints: int
) -> dict[str, Any]:
    """The moving arms, and the positions of copies of the first one, for given joint counts."""
    base = base_joints(shown.robot)
    ghosts = base.positions(copies)
    unmoved = np.zeros(joints - ghosts.shape[1])  # ghosts have only the robot's joints
    arms = {shown.trajectory.planner or "trajectory": shown.curve, **motions}
    return {
        "arms": [
            arm_frames(name, motion, shown.robot, shown.model, shown.scenario.paths)
            for name, motion in arms.items()
        ],
        "ghosts": [[*position, *unmoved] for position in ghosts.tolist()],
        "first_joint": base.count,
    }


def _description(shown: ShownMotion) -> dict[str, Any]:
    """Title of the scene and its units."""
    scenario, units = shown.scenario, shown.scenario.units
    return {
        "title": scenario.name,
        "robot": shown.robot.name,
        "planner": shown.trajectory.planner,
        "description": scenario.task.description.strip(),
        "joint_panel": joint_panel(shown.robot, units),
        "units": {"length": units.length, "per_metre": units.shown(1.0, "m")[0]},
    }


def _robot_parts(
    shown: ShownMotion, size: float, before: Mapping[str, Any] | None
) -> tuple[dict[str, Any], list[str]]:
    """The parts `ROBOT_PARTS`, reused from `before` if equal, and unreadable images."""
    parts = [mesh for meshes in shown.shapes.parts for mesh in meshes]
    images = list(dict.fromkeys(mesh.image for mesh in parts if mesh.image is not None))
    addresses, unread = image_addresses(images)
    known, base = known_joints(shown), base_joints(shown.robot)
    carried = [*([] for _ in base.joints), *shown.shapes.parts, *([] for _ in known)]
    reused: dict[str, Any] = {
        "joints": base.below([*drawn_joints(shown.robot), *known]),
        "shapes": [[pack_mesh(mesh, images) for mesh in parts] for parts in carried],
        "images": addresses,
    }
    if before is not None and all(reused[name] == before[name] for name in reused):
        return {name: before[name] for name in ROBOT_PARTS}, unread
    shapes = [*(None for _ in base.joints), *shown.shapes.shapes, *(None for _ in known)]
    cell = GHOST_DETAIL * size
    reused["coarse"] = [pack_mesh(coarse(mesh, cell)) if mesh else None for mesh in shapes]
    return reused, unread


def _merge_labels(labels: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Labels, with one for an object and a frame of the same name."""
    frames, objects = (
        {label["text"] for label in labels if label["kind"] == kind} for kind in ("frame", "object")
    )
    shared = frames & objects
    merged = [label for label in labels if label["kind"] != "object" or label["text"] not in shared]
    for label in merged:
        if label["text"] in shared:
            label["detail"] = f"frame and object {label['text']!r}"
    return merged


def _extreme_points(points: FloatArray, most: int = 800) -> FloatArray:
    """Points that are extreme in some direction."""
    turns = np.random.default_rng(0).normal(size=(most, 3))
    return np.asarray(points[np.unique((turns @ points.T).argmax(axis=1))])


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


@dataclass(frozen=True, eq=False)
class Stops:
    """The arm at the waypoints, in world axes.

    Attributes:
        position: Joint positions at each waypoint [rad or m], shape (s, d).
        outlines: Corners of bounding boxes of the links at each waypoint [m], shape (s, n, 3).
        passed: Corners along the motion, which must also be in view, shape (k, n, 3).
    """

    position: FloatArray
    outlines: FloatArray
    passed: FloatArray

    def distinct(self, size: float) -> list[int]:
        """Indices of distinct ones, so that copies of the arm can be distinguished.

        Args:
            size: Extent of the scene [m].
        """
        chosen = [0]
        apart = np.full(len(self.outlines), np.inf)
        while len(chosen) < MOST_COPIES:
            moved = np.linalg.norm(self.outlines - self.outlines[chosen[-1]], axis=2).max(axis=1)
            apart = np.minimum(apart, moved)
            if apart.max() <= LEAST_DISTANCE * size:
                break
            chosen.append(int(apart.argmax()))
        return chosen


def find_stops(shown: ShownMotion) -> Stops:
    """The arm at the waypoints, or without any at both ends of the motion."""
    robot, curve, times = shown.robot, shown.curve, shown.times
    start, end = curve.x[[0, -1]]
    times = times[(times >= start) & (times <= end)]
    times = times[:: len(times) // MOST_STOPS + 1] if len(times) else curve.x[[0, -1]]
    position = np.asarray(curve(times))
    boxes = [mesh if mesh is None else box_corners(mesh.vertices) for mesh in shown.shapes.shapes]
    joints = joint_tree(robot.model)

    def outlines(q: FloatArray) -> FloatArray:
        rotation, origin = place_joints(joints, q)
        placed = [
            box @ rotation[:, i].swapaxes(1, 2) + origin[:, i, np.newaxis]
            for i, box in enumerate(boxes)
            if box is not None
        ]
        return base_joints(robot).to_world(q, np.concatenate(placed, axis=1))

    return Stops(
        position, outlines(position), outlines(curve(np.linspace(start, end, PASSED_SAMPLES)))
    )
