"""Actions along the motion: signals that are switched, and waits."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    WithJsonSchema,
    model_validator,
)

from knotwork.files.documents.values import (
    MAX_NUMBER,
    Forms,
    NonEmpty,
    Number,
    Positive,
    optional,
)
from knotwork.task.task_part import TaskPart

Wait = Annotated[Positive, Field(ge=1e-3)]
"""Duration of a wait, at least 1 ms: shorter ones are indistinguishable from rounding of times."""


def _check_signal_value(value: Any) -> Any:
    fine = isinstance(value, str) and value
    if not fine and not (isinstance(value, int | float) and abs(value) <= MAX_NUMBER):
        raise ValueError("must be true, false (or on, off), a number or text")
    return value


SWITCHED = {"on": True, "off": False}


def parse_switched(value: Any) -> Any:
    """A value, with on and off as true and false."""
    return SWITCHED.get(value, value) if isinstance(value, str) else value


def one_name_each(outputs: dict[str, int]) -> dict[str, int]:
    """Outputs by name, unless two names share one output."""
    names: dict[int, str] = {}
    for name, number in outputs.items():
        if number in names:
            raise ValueError(
                f"{names[number]!r} and {name!r} are both output {number}; give an output one name"
            )
        names[number] = name
    return outputs


Output = Annotated[int, Field(strict=True, ge=0, le=65535)]
Switched = Annotated[
    bool,
    Field(strict=True),
    BeforeValidator(parse_switched),
    WithJsonSchema({"anyOf": [{"type": "boolean"}, {"enum": ["on", "off"]}]}),
]
SignalValue = Annotated[Any, AfterValidator(_check_signal_value)]


class Action(TaskPart):
    """One action along the motion: a signal with a name of your own, an output, or a wait."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, SignalValue]
    ALTERNATIVES = (("at", "after", "before"),)

    output: Output | None = optional("Number of the digital output that is set to the value")
    value: Switched | None = optional("Value of the output")
    wait: Wait | None = optional("Waiting time, before the next action in the list", unit="s")
    at: Number | None = optional(
        "Distance after the waypoint along the tool path; before it, if negative", unit="length"
    )
    after: Positive | None = optional("Time after arrival at the waypoint", unit="s")
    before: Positive | None = optional("Time before arrival at the waypoint", unit="s")

    def __repr_args__(self) -> list[tuple[str, Any]]:
        return [*self.signals.items(), *super().__repr_args__()]

    @property
    def signals(self) -> dict[str, Any]:
        """Values by the signal names of the task; at most one."""
        return self.__pydantic_extra__ or {}

    @model_validator(mode="after")
    def _check_action(self) -> Action:
        actions = [key for key in ("output", "wait") if getattr(self, key) is not None]
        names = [*self.signals, *actions]
        if not names:
            raise ValueError("does nothing; give a signal ({gripper: close}), an output or a wait")
        if len(names) > 1:
            listed = " and ".join(names)
            raise ValueError(
                f"does {listed} in one action; accepted: one of them, with at, after or before, or "
                "a list of actions"
            )
        if "" in self.signals:
            raise ValueError("gives a signal without a name; give it one, as in {gripper: close}")
        if (self.output is None) != (self.value is None):
            raise ValueError("needs output and value together, as in {output: 3, value: true}")
        if self.wait is not None and {"at", "after", "before"} & self.model_fields_set:
            raise ValueError("a wait is at the waypoint itself; leave out at, after and before")
        return self


Actions = Annotated[
    Action | NonEmpty[Action], Forms("a mapping, as {gripper: close}, or a list of mappings")
]
