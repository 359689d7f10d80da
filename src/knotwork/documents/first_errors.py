"""Errors of data against a model: of very many the first, in little memory.

Pydantic tells the errors that it found only all at once, at half a kilobyte each. Data with a
million of them is therefore checked again up to a place before which it has some thousands.
"""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ValidationError

FEW, MANY = 1_000, 10_000
"""More than the first are reported where there are as many, and fewer than the second."""


class _Beginning:
    """The first values of plain data, in the order of the file.

    Attributes:
        data: Mappings and lists up to the last of the values.
        broken: Identities of those that are not whole.
    """

    def __init__(self, data: Any, values: int) -> None:
        self._left = values
        self.broken: set[int] = set()
        self.data = self._begun(data)

    def _begun(self, part: Any) -> Any:
        self._left -= 1
        if not isinstance(part, dict | list):
            return part
        kept = []
        for key, value in part.items() if isinstance(part, dict) else enumerate(part):
            if self._left <= 0:
                break
            kept.append((key, self._begun(value)))
        begun = dict(kept) if isinstance(part, dict) else [value for _, value in kept]
        if self._left <= 0:
            self.broken.add(id(begun))
        return begun


def first_errors(model: type[BaseModel], data: dict[str, Any]) -> list[dict[str, Any]]:
    """What pydantic says against data, as its `errors()`; of very many the first ones."""
    count = _count(model, data)
    low, high = 0, _size(data) + 1
    while count > MANY and high - low > 1:
        middle = (low + high) // 2
        found = _count(model, _Beginning(data, middle).data)
        if found > FEW:
            high, count = middle, found
        else:
            low = middle
    beginning = _Beginning(data, high)
    try:
        model.model_validate(beginning.data)
    except ValidationError as error:
        reported = error.errors(include_url=False)
        return [dict(one) for one in reported if id(one["input"]) not in beginning.broken]
    return []


def _count(model: type[BaseModel], data: Any) -> int:
    try:
        model.model_validate(data)
    except ValidationError as error:
        return error.error_count()
    return 0


def _size(data: Any) -> int:
    if not isinstance(data, dict | list):
        return 1
    return 1 + sum(map(_size, data.values() if isinstance(data, dict) else data))
