"""Objects stay where they lie while a positioner and its arm stop or slow down."""

from __future__ import annotations

from pathlib import Path

import pinocchio as pin
import pytest

import knotwork as kw
from moving.moving_truth import OfArm, links
from moving.test_held_on_belts import check_box
from moving.test_placed_urdfs import Composed, folder
from moving.test_two_carriers import OFFSET, PICK, PLACE, fetch, named, part, tcp
from sweeps import mostly_exhaustive

__all__ = ["folder"]


@pytest.fixture(scope="module", params=mostly_exhaustive(["one frame", "own frames"], "own frames"))
def fetched(folder: Path, request: pytest.FixtureRequest) -> kw.Plan:
    given = fetch(folder, limits={"acceleration": 20})
    if request.param == "own frames":
        frame = given.pop("frame")
        given["waypoints"] = [{"frame": frame, **one} for one in given["waypoints"]]
    return kw.plan(given)


@pytest.mark.parametrize("at", [1.0, 13.0])
def test_part_stays_in_cell_or_on_plate(fetched: kw.Plan, folder: Path, at: float) -> None:
    stop, both = fetched.stop(at), Composed(folder)

    def lies(time: float) -> pin.SE3:
        return tcp(both, named(fetched, time)) * OFFSET

    on_plate = part(both, named(fetched, PLACE)).actInv(lies(PLACE))

    def box(t: float) -> pin.SE3:
        return lies(PICK) if at < PICK else part(both, named(stop, t)) * on_plate

    fixed = {"shoulder_link", "upper_arm_link", "forearm_link"}
    check_box(stop, links(OfArm(stop), pin.SE3.Identity()), box, fixed)
    assert not stop.report.select(quantity="held_object")


def test_part_without_carrier_is_named(fetched: kw.Plan) -> None:
    (note,) = fetched.scaled({0: 0.5}).report.select(quantity="held_object")
    assert note.message.startswith("before 'pick', 'box' moves relative to the frame of the poses")
