"""Plans played in Meshcat: what its Python package would send to a server."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from PIL import Image

import knotwork as kw
from knotwork.errors import InputError
from plans import planned

meshcat = pytest.importorskip("meshcat")


class Window:
    """Takes what is sent to Meshcat's server."""

    def __init__(self) -> None:
        self.sent: list[dict[str, Any]] = []

    def send(self, command: Any) -> None:
        self.sent.append(command.lower())

    def kinds(self, kind: str) -> list[dict[str, Any]]:
        return [one for one in self.sent if one["type"] == kind]


@pytest.fixture(scope="module")
def plan() -> kw.Plan:
    return planned("planar2_closed_form")


def test_the_animation_is_the_motion(plan: kw.Plan) -> None:
    window = Window()
    plan.play(meshcat.Visualizer(window=window))
    drawn = {one["path"].split("/")[-1].rstrip(" 0123456789") for one in window.kinds("set_object")}
    assert {"shape", "path", "waypoints", "knots", "tool"} <= drawn
    (shown,) = window.kinds("set_animation")
    moved = {one["path"].split("/")[-1]: one["clip"] for one in shown["animations"]}
    robot = plan.joints.robot
    for share in (0.0, 0.37, 1.0):
        pose = pin.SE3.Identity()
        for name in robot.joint_names:
            tracks = {one["name"]: one["keys"] for one in moved[name]["tracks"]}
            frame = round(share * (len(tracks[".position"]) - 1))
            turn = pin.Quaternion(np.array(tracks[".quaternion"][frame]["value"]))
            pose *= pin.SE3(turn, np.array(tracks[".position"][frame]["value"]))
            time = tracks[".position"][frame]["time"] / moved[name]["fps"]
        pose *= robot.model.frames[robot.tcp_frame_id].placement
        true = robot.base_placement * robot.forward(plan.trajectory.position(time))
        assert pose.translation == pytest.approx(true.translation, abs=2e-6)
    assert time == pytest.approx(plan.trajectory.duration)


def test_the_board_has_the_verdict_and_the_camera_looks_at_the_scene() -> None:
    window, plan = Window(), planned("planar2_closed_form", planner="parabolic-blend")
    plan.play(meshcat.Visualizer(window=window))
    (board,) = (one for one in window.kinds("set_object") if one["path"].endswith("/board"))
    (picture,) = board["object"]["images"]
    data = base64.b64decode(picture["url"].partition(",")[2])
    pixels = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)
    red, green, blue = np.moveaxis(pixels, 2, 0)
    dark_red = (red > 150) & (green < 60) & (blue < 60)
    assert dark_red.sum() > 0.01 * red.size  # it fails, and says so in red
    (place,) = (one for one in window.kinds("set_transform") if one["path"].endswith("/board"))
    turned = np.array(place["matrix"]).reshape(4, 4).T[:3, :3]
    assert turned[:, 1] == pytest.approx([0, 0, 1])  # upright
    (eye,) = [one["value"] for one in window.kinds("set_property") if one["property"] == "position"]
    seen_from = np.array([eye[0], -eye[2], eye[1]])
    assert turned[:, 2] @ seen_from > 0.3 * np.linalg.norm(seen_from)  # it faces the camera


def test_pinocchios_visualizer_is_taken_and_its_own_robot_hidden(plan: kw.Plan) -> None:
    from pinocchio.visualize import MeshcatVisualizer

    shown = MeshcatVisualizer(pin.Model(), pin.GeometryModel(), pin.GeometryModel())
    with pytest.raises(InputError, match="initViewer"):
        plan.play(shown)
    window = Window()
    shown.initViewer(viewer=meshcat.Visualizer(window=window))
    shown.loadViewerModel()
    plan.play(shown)
    hidden = [one for one in window.kinds("set_property") if one["property"] == "visible"]
    assert any("pinocchio" in one["path"] and not one["value"] for one in hidden)
    assert len(window.kinds("set_animation")) == 1


def test_what_is_no_viewer_is_refused(plan: kw.Plan) -> None:
    with pytest.raises(InputError, match="can't play in str"):
        plan.play("tcp://127.0.0.1:6000")


def test_viewer_of_the_command_faces_the_arm(
    plan: kw.Plan, knotwork: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    window = Window()
    window.web_url = "http://127.0.0.1/"  # type: ignore[attr-defined]
    viewer = meshcat.Visualizer(window=window)
    monkeypatch.setattr("meshcat.Visualizer", lambda: viewer)
    monkeypatch.setattr("time.sleep", lambda _: (_ for _ in ()).throw(KeyboardInterrupt))
    ran = knotwork("view", "planar2_closed_form", "--no-open", "--meshcat")
    assert ran.out.endswith("until Ctrl-C\nstopped\n")
    (eye,) = [one["value"] for one in window.kinds("set_property") if one["property"] == "position"]
    assert 0.5 < np.linalg.norm(eye) < 4.0  # of an arm that is 0.9 m long
