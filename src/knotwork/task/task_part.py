"""`TaskPart`: the base class of all parts of a task, which validates them when they are created."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterator, Mapping
from inspect import Parameter, Signature, get_annotations
from io import IOBase
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from pydantic import ConfigDict

from knotwork.errors import format_value
from knotwork.files.documents import Document, StrictModel, validate

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass as _WithSignature
    from typing_extensions import Self
else:

    class _WithSignature(type(StrictModel)):
        """Shows the fields as the signature; pydantic does so only after the first use."""

        @property
        def __signature__(cls) -> Signature:
            types = ChainMap(*(get_annotations(base) for base in cls.__mro__))
            parameters = []
            for name, field in cls.model_fields.items():
                value = field.get_default(call_default_factory=True)
                default = Parameter.empty if field.is_required() else value
                parameters.append(
                    Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=types[name])
                )
            if cls.model_config.get("extra") == "allow":
                parameters.append(Parameter("values", Parameter.VAR_KEYWORD))
            return Signature(parameters)

        @__signature__.setter
        def __signature__(cls, signature: Signature) -> None:
            """Ignore that of pydantic."""


_DEEPEST = 8
"""Maximum depth of a task. Deeper values are left unchanged here, and refused later."""


class TaskPart(StrictModel, metaclass=_WithSignature):
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

        def __init__(self, *unnamed: Any, **values: Any) -> None:
            fields = type(self).model_fields
            keys = {name: field.validation_alias or name for name, field in fields.items()}
            data = {keys.get(name, name): plain(value) for name, value in values.items()}
            document = Document(data, prefix=(type(self).__name__,))
            if unnamed:
                names = ", ".join(f"{name}=…" for name in fields)
                given = format_value(plain(unnamed[0]))
                raise document.error((), f"{given}: is without a name", names)
            validate(type(self), document, self)

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
    if isinstance(value, Path | IOBase):  # an open file is an iterator, but no list
        return str(value)
    if isinstance(value, list | tuple | Iterator) and depth < _DEEPEST:
        return [plain(item, depth + 1) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if hasattr(value, "homogeneous"):  # a `pin.SE3`, without loading Pinocchio
        return {"position": value.translation.tolist(), "rotation_matrix": value.rotation.tolist()}
    return value
