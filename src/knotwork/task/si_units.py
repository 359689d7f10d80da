"""The units of a task's values, which are data of its fields.

Joint values are angles or lengths depending on the joint, which a task alone does not define: they
stay in the given units.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from knotwork.files.documents import Location, field_at
from knotwork.files.documents.values import unit_of
from knotwork.task.task import Task, TaskUnits
from knotwork.task.task_part import PartT, TaskPart

_RATE_SUFFIX = re.compile(r"/s[²³⁴]?$")
"""End of the units of rates: the factor of `length/s²` is that of `length`.

Units with `or` depend on the joint and have no factor.
"""


def unit_at(data: Any, location: Location, joints: Mapping[str, str] | None = None) -> str:
    """The unit of a value of a scenario file; empty without one, or if it is unknown.

    >>> unit_at({"units": {"length": "mm"}, "tolerances": {"path": 1}}, ("tolerances", "path"))
    'mm'

    Args:
        data: Data of the file.
        location: Location of the value.
        joints: `"rad"` or `"m"` by joint name, where known.
    """
    unit = unit_of(field_at(Task, data, location))
    if " or " in unit:
        kind = (joints or {}).get(str(location[-1]))
        choices = dict(zip(("rad", "m"), unit.split(" or "), strict=True))
        unit = choices.get(kind or "", "")
    file_units = data.get("units") or {}
    own_units = {"length": file_units.get("length", "m"), "angle": file_units.get("angle", "rad")}
    return re.sub("length|angle", lambda word: own_units[word[0]], unit)


def to_si(part: PartT, units: TaskUnits) -> PartT:
    """A task, or a part of one, with all but joint values in SI; its own `units` become SI.

    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 2}]
    >>> units = kw.task.TaskUnits(length="mm")
    >>> task = kw.Task(units=units, path={"acceleration": 500.0}, waypoints=ends)
    >>> in_si = to_si(task, task.units)
    >>> to_si(in_si, in_si.units).path.acceleration
    0.5

    Args:
        part: Task or part.
        units: Its units.
    """
    length, angle = units.in_si
    factors = {"length": length, "angle": angle}

    def scaled(value: Any, factor: float) -> Any:
        if isinstance(value, TaskUnits):
            return TaskUnits()
        if isinstance(value, TaskPart):
            return to_si(value, units)
        if isinstance(value, dict):
            return {key: scaled(item, factor) for key, item in value.items()}
        if isinstance(value, tuple):
            return tuple(scaled(item, factor) for item in value)
        return factor * value if isinstance(value, float) and factor != 1.0 else value

    if length == angle == 1.0:
        return part
    changed = {
        name: scaled(getattr(part, name), factors.get(_RATE_SUFFIX.sub("", unit_of(field)), 1.0))
        for name, field in type(part).model_fields.items()
        if name in part.model_fields_set
    }
    return part.model_copy(update=changed)
