"""Errors of data against a model: of very many the first, in little memory.

Pydantic tells the errors that it found only all at once, at half a kilobyte each. Data with a
million of them is therefore checked again from its beginning, until some thousands are found.
"""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ValidationError

FEW = 1_000
"""More are reported where there are as many."""

STEP = 2
"""Factor between the numbers of values of the beginnings that are checked one after another."""


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
    values = FEW
    while True:
        beginning = _Beginning(data, values)
        try:
            model.model_validate(beginning.data)
        except ValidationError as error:
            reported = error.errors(include_url=False)
            found = [dict(one) for one in reported if id(one["input"]) not in beginning.broken]
            if len(found) > FEW or not beginning.broken:
                return found
        else:
            if not beginning.broken:
                return []
        values *= STEP
