"""The units that a mapping of points states: they must be those that its values are read in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from knotwork.documents import Document, Location
from knotwork.errors import did_you_mean
from knotwork.foreign.table import QUANTITIES
from knotwork.foreign.units import SECONDS, is_rate
from knotwork.joint_quantities import rate_unit

KEYS: dict[str, tuple[str, ...]] = {
    "time": ("time_from_start", "time", "times", "t"),
    "position": ("positions", "position", "q"),
    "velocity": ("velocities", "velocity", "qd"),
    "acceleration": ("accelerations", "acceleration", "qdd"),
}
"""Keys under which a mapping may give each quantity."""

UNUSED_IN_POINT = ("effort", "efforts", "jerk", "jerks")
_ORDERS = {"joints": 0} | {key: i for i, name in enumerate(QUANTITIES) for key in KEYS[name]}


def check_units(
    document: Document, data: Mapping[str, Any], at: Location, joints: Sequence[tuple[str, str]]
) -> None:
    """Refuse units other than the joints' own: values are taken in s and rad or m, as in ROS.

    `units` may be the unit of all joints, a list with one for each, or a mapping: `time`, `joints`,
    a joint's name, or a quantity such as `velocities` to such units.

    Args:
        document: The document.
        data: The part of it that may have `units`.
        at: Where that part is.
        joints: Names and units of the joints as the file lists them.

    Raises:
        DocumentError: A unit is another one, or stated for what is not understood.
    """
    units = data.get("units")
    if units is None or units in ({}, []):
        return
    where = (*at, "units")
    if not isinstance(units, dict):
        _check_joints(document, units, where, joints, 0)
        return
    for key, stated in units.items():
        if stated is None or key in UNUSED_IN_POINT:
            continue
        if key in KEYS["time"]:
            if not isinstance(stated, str) or stated.strip().lower() not in SECONDS:
                raise document.error((*where, key), f"times are in {stated!r}", "'s'")
        elif key in dict(joints):
            own = [(name, unit) for name, unit in joints if name == key]
            _check_joints(document, stated, (*where, key), own, 0)
        elif key in _ORDERS:
            _check_joints(document, stated, (*where, key), joints, _ORDERS[key])
        else:
            known = ("time", "joints", "positions", "velocities", "accelerations")
            raise document.error((*where, key), "unknown key", did_you_mean(key, known))


def _check_joints(
    document: Document,
    stated: Any,
    where: Location,
    joints: Sequence[tuple[str, str]],
    order: int,
) -> None:
    listed = stated if isinstance(stated, list) else [stated] * len(joints)
    if len(listed) != len(joints):
        raise document.error(where, f"has {len(listed)} entries", f"{len(joints)}, as joint names")
    for (name, unit), stated in zip(joints, listed, strict=True):
        if not isinstance(stated, str) or not is_rate(stated, unit, order):
            wanted = rate_unit(unit, order)
            raise document.error(where, f"joint {name!r} is in {stated!r}", f"{wanted!r}")
