"""`TaskPart`: the base class of all parts of a task, which validates them when they are created."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from pydantic import ConfigDict

from knotwork.files.documents import Document, StrictModel, validate

if TYPE_CHECKING:
    from typing_extensions import Self

_DEEPEST = 8
"""Maximum depth of a task. Deeper values are left unchanged here, and refused later."""


class TaskPart(StrictModel):
    """A part of a task.

    NumPy arrays are accepted in place of lists, and a `pin.SE3` in place of a pose.

    Raises:
        DocumentError: A value is missing, unknown or wrong; `problems` has all of them.
    """

    # The schema of files has the first sentence of a docstring.
    model_config = ConfigDict(
        json_schema_extra=lambda schema: schema.update(
            description=str(schema.get("description", "")).partition("\n\n")[0]
        )
    )

    if not TYPE_CHECKING:  # type checkers know the fields

        def __init__(self, **values: Any) -> None:
            fields = type(self).model_fields
            keys = {name: field.validation_alias or name for name, field in fields.items()}
            data = {keys.get(name, name): plain(value) for name, value in values.items()}
            validate(type(self), Document(data, prefix=(type(self).__name__,)), self)

        # Parts read from a file are made without it, all at once.
        __init__.__pydantic_base_init__ = True

    def replace(self, **changes: Any) -> Self:
        """A copy with other values, validated.

        >>> kw.task.Euler(order="ZYX", angles=[0, 0, 1]).replace(order="XYZ").order
        'XYZ'

        Args:
            changes: New values by field name; `None` removes a value.

        Raises:
            DocumentError: A value is unknown or wrong.
        """
        values = {name: getattr(self, name) for name in self.model_fields_set} | changes
        return type(self)(**{name: value for name, value in values.items() if value is not None})

    def __repr_args__(self) -> list[tuple[str, Any]]:
        fields = type(self).model_fields
        return [(name, getattr(self, name)) for name in fields if name in self.model_fields_set]

    def to_dict(self) -> dict[str, Any]:
        """The given values as plain data, with the keys of a scenario file."""
        dumped = self.model_dump(by_alias=True, exclude_unset=True)
        return cast(dict[str, Any], plain(dumped))


PartT = TypeVar("PartT", bound=TaskPart)


def plain(value: Any, depth: int = 0) -> Any:
    """A Python value as plain data: no arrays, poses or paths."""
    if isinstance(value, Mapping) and depth < _DEEPEST:
        return {key: plain(item, depth + 1) for key, item in value.items()}
    if isinstance(value, list | tuple) and depth < _DEEPEST:
        return [plain(item, depth + 1) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if hasattr(value, "homogeneous"):  # a `pin.SE3`, without loading Pinocchio
        return {"position": value.translation.tolist(), "rotation_matrix": value.rotation.tolist()}
    return str(value) if isinstance(value, Path) else value
