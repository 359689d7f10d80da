"""`Finding`: one thing that the check says about a motion, whatever it is about."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from knotwork.errors import InputError

Verdict = Literal["met", "failed", "undecided", "warning", "information"]
Proof = Literal["exact", "bounded", "sampled"]

TRIED = "tried"
"""Quantity of findings on what was tried because something fails."""
NOT_IN_DATA = ("around", "bodies", "brief", "label", "remedy")
"""Name and message say more than they do, so that data leave them out."""


@dataclass(frozen=True)
class Finding:
    """One thing that the check says.

    >>> report = kw.plan("ur5_deburring").report
    >>> (speed,) = report.select(quantity="tool_speed")
    >>> speed.ok, speed.limit, speed.proof
    (True, 0.25, 'bounded')

    Everything that shows a report (table, page, JSON, marks in the 3D scene, exit code) iterates
    over findings and knows no check by name.

    Attributes:
        group: Heading that it is listed under, for example `"Joint limits"`.
        subject: Kind of thing that it is about: `"waypoint"`, `"joint"`, `"tool"`, `"link"`,
            `"pair"` (of bodies), `"path"`, `"wait"`, `"event"`, `"segment"` or `"motion"`.
        name: Which one, for example the name of the joint; empty where there is only one.
        quantity: What was looked at, for example `"velocity"`.
        verdict: `"met"` or `"failed"` for what is required; `"undecided"` for what is required and
            a log is too noisy to tell; `"warning"` for a plausible slip; `"information"`
            for what nothing is required of. Only `"failed"` fails a report.
        message: All of it in one sentence.
        value: What was found, or the error where something was requested; infinite at a jump,
            `None` where there is no number.
        limit: The limit or tolerance, with the sign that it has on that side; `None` without one.
        margin: Distance left to the limit, for a bounded value that is proved; negative beyond the
            limit, `None` without one and where samples alone keep it.
        unit: SI unit of value, limit and margin.
        time: When it is worst [s], or `None`.
        interval: From when to when [s] it holds, or `None` where one time or all time is meant.
        intervals: Each such interval where there are several; `interval` is the worst.
        proof: `"exact"` holds for all time; so does `"bounded"`, with value and excess together;
            `"sampled"` holds at the times looked at, so it shows no margin to a limit.
        excess: By how much the true worst value may lie beyond the one found.
        requested: What was asked for, where that is a vector; an orientation as a quaternion
            x, y, z, w.
        achieved: What the motion does, in the same form.
        points: Places that it is about, in the base frame [m].
        label: Words for it in a picture, where quantity, value and limit don't say it well.
        remedy: How to make it pass, if that is known; the message ends with it.
        brief: What short reports say of it even where all is well, if anything.
        detail: Tables leave it out, because another finding says more; reports as data have it.
        around: Of a pair of bodies: one of them is an object of the scene.
        bodies: Of a pair of bodies: their names.
        form: Unit of requested and achieved where it is not that of the value.
    """

    group: str
    subject: str
    name: str
    quantity: str
    verdict: Verdict
    message: str
    value: float | None = None
    limit: float | None = None
    margin: float | None = None
    unit: str = ""
    time: float | None = None
    interval: tuple[float, float] | None = None
    intervals: tuple[tuple[float, float], ...] = ()
    proof: Proof = "exact"
    excess: float = 0.0
    requested: tuple[float, ...] | None = None
    achieved: tuple[float, ...] | None = None
    form: str = ""
    points: tuple[tuple[float, ...], ...] = ()
    label: str = ""
    remedy: str = ""
    brief: str = ""
    detail: bool = False
    around: bool = False
    bodies: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a value that is no number; drop a margin that is not proved, or is rounding.

        Raises:
            InputError: The value is NaN, of which nothing could be judged.
        """
        if self.proof == "sampled" and (self.margin or 0.0) >= 0.0:
            object.__setattr__(self, "margin", None)
        elif self.verdict == "met" and self.margin is not None:
            object.__setattr__(self, "margin", max(self.margin, 0.0))
        if self.value is not None and math.isnan(self.value):
            raise InputError(
                f"a finding on {self.quantity!r} of {self.subject} {self.name!r} has the value "
                "NaN; accepted: a number, infinity for a jump, or None"
            )

    @property
    def ok(self) -> bool:
        """Whether nothing fails here."""
        return self.verdict != "failed"

    @property
    def required(self) -> bool:
        """Whether something is required here, so that it can fail."""
        return self.verdict in ("met", "failed")

    @property
    def only_sampled(self) -> bool:
        """Whether it counts as met because of samples alone."""
        return self.verdict == "met" and self.proof == "sampled"

    @property
    def title(self) -> str:
        """The quantity in words."""
        return self.quantity.replace("_", " ")

    @property
    def at(self) -> float | None:
        """Time to look at [s]; the worst one, or the start of the interval; `None` for all time."""
        return self.interval[0] if self.time is None and self.interval else self.time

    @property
    def spans(self) -> tuple[tuple[float, float], ...]:
        """From when to when [s] it holds, each time; none where one time or all time is meant."""
        return self.intervals or ((self.interval,) if self.interval is not None else ())

    @property
    def when(self) -> str:
        """The worst time, or else the interval, to milliseconds."""
        if self.time is None and self.interval is not None:
            return "{:.3f} to {:.3f}".format(*self.interval)
        return "" if self.time is None else f"{self.time:.3f}"

    @property
    def use(self) -> float | None:
        """Part of the limit that is used; `None` without a limit that can be used in part.

        Where samples alone keep a limit the part is not known: `None`, too. It is infinite at a
        jump, and where a limit from below is left by a value beyond zero.
        """
        if self.value is None or not self.limit:
            return None
        if self.proof == "sampled" and self.margin is None:
            return None
        if self.value * self.limit < 0.0 and self.margin is not None and self.margin < 0.0:
            return math.inf
        share = abs(self.value / self.limit)
        from_below = self.margin is not None and (share - 1.0) * self.margin > 0.0
        return 1.0 / share if from_below and share else share

    def with_remedy(self, text: str) -> Finding:
        """The same finding, whose message ends with a remedy, unless that is empty."""
        return replace(self, message=f"{self.message}; {text}", remedy=text) if text else self

    @property
    def fact(self) -> str:
        """What was found, without the remedy."""
        return self.message.removesuffix(f"; {self.remedy}") if self.remedy else self.message

    def to_dict(self) -> dict[str, Any]:
        """Give it as plain data, ready for JSON; infinite numbers are `None`."""
        data = {key: _plain(value) for key, value in asdict(self).items() if key not in NOT_IN_DATA}
        return {"ok": self.ok, **data}

    def __str__(self) -> str:
        return self.message


def united(spans: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Spans of time, those that meet made one, in order."""
    found: list[tuple[float, float]] = []
    for start, end in sorted(spans):
        if found and start <= found[-1][1]:
            found[-1] = found[-1][0], max(found[-1][1], end)
        else:
            found.append((start, end))
    return found


def judged(ok: bool, *, required: bool = True) -> Verdict:
    """Verdict on something that is, or is not, required."""
    if not required:
        return "information"
    return "met" if ok else "failed"


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    return value
