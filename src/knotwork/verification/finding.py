"""`Finding`: one result of a check of a motion."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

from knotwork.errors import InputError, format_value
from knotwork.errors.old_names import OldAttribute

Subject = Literal[
    "waypoint", "joint", "tool", "link", "pair", "path", "wait", "event", "segment", "cycle",
    "motion",
]  # fmt: skip
"""Kind of subject of a finding; a pair is one of bodies."""
Verdict = Literal["met", "failed", "undecided", "warning", "information"]
Proof = Literal["exact", "bounded", "sampled"]


class Group:
    """Headings of a report, under which its findings are grouped.

    `CHOSEN_TIMES` is for tasks that leave a time to planning, `CHOSEN_MOTION` for those that
    leave only velocities, knots or solutions. Findings of `FEASIBILITY` hold for every motion
    through the joint waypoints.
    """

    AGAINST_PLAN = "Against the plan"
    CHOSEN_MOTION = "Chosen motion"
    CHOSEN_TIMES = "Chosen times"
    COLLISIONS = "Collisions"
    CONTINUITY = "Continuity"
    CYCLES = "Cycles"
    EVENTS = "Events"
    FEASIBILITY = "Feasibility"
    FREEDOM = "Freedom"
    JOINT_LIMITS = "Joint limits"
    JOINTS_AT_WAYPOINTS = "Joints at the waypoints"
    LOG = "Log"
    MOTION = "Motion"
    NOT_PLANNED = "Not planned"
    NO_LIMIT = "No limit known"
    SEGMENTS = "Segments"
    SINGULARITY = "Singularity"
    TOLERANCES = "Tolerances"
    TOOL_AT_WAYPOINTS = "Tool at the waypoints"
    TOOL_LIMITS = "Tool and links"
    TOOL_PATHS = "Tool paths"
    WAITS = "Waits"
    WARNINGS = "Warnings"
    WAYS = "Ways"


PASSING_VERDICTS: tuple[Verdict, ...] = ("met", "undecided", "warning", "information")
"""Verdicts that do not fail a report."""
REMEDIES_TRIED = "remedies_tried"
"""Quantity of findings on remedies that planning has tried in vain."""
NOT_IN_DATA = ("involves_scene", "bodies", "highlight", "fact", "short_fact", "remedy")
"""Fields that JSON lacks: they are for other outputs, or contained in name and message."""


@dataclass(frozen=True)
class Finding:
    """One result of a check.

    >>> report = kw.plan("ur5_deburring").report
    >>> (speed,) = report.select(quantity="tool_speed")
    >>> speed.ok, speed.limit, speed.proof
    (True, 0.25, 'bounded')

    Tables, JSON, marks in the 3D scene and the exit code iterate over findings and name no check.
    Plots, the time strip, figures of sweeps and verdicts on logs pick some by their quantity.

    Attributes:
        group: Heading in the report, for example `"Joint limits"`; those of `Group`, or a new one.
        subject: Kind of subject, for example `"joint"`.
        name: Name of the subject, for example of the joint; empty if there is only one.
        quantity: Quantity, for example `"velocity"`.
        verdict: `"met"` or `"failed"` for a requirement; `"undecided"` for a requirement that can't
            be decided with a noisy log; `"warning"` for a probable mistake; `"information"` without
            a requirement. Only `"failed"` fails a report.
        fact: The finding as one sentence, without the remedy.
        value: The value, or the error of a requested value; infinite at a jump, `None` if there is
            no number.
        limit: The limit or tolerance on the side of the value; `None` if there is none.
        margin: Proved distance to the limit, negative beyond it. `None` without a limit, or if only
            samples keep it.
        unit: SI unit of value, limit and margin.
        time: Time of the worst value [s], or `None`.
        interval: Time interval [s]; `None` for a single time or the whole motion.
        intervals: All intervals, if there are any; `interval` is the worst.
        proof: `"exact"` and `"bounded"` (value plus `proof_gap`) hold for all time; `"sampled"`
            holds at samples only, so there is no margin to a limit.
        proof_gap: Maximum difference between the true worst value and `value`.
        requested: Requested vector; an orientation as a quaternion x, y, z, w.
        achieved: Achieved vector, in the same form.
        points: Points of the finding in the base frame [m].
        short_fact: The fact in a few words; if empty, outputs compose one of name, quantity, value
            and limit.
        remedy: Remedy, or the reason why the usual one does not help; empty if unknown.
        highlight: Text that short reports print even if nothing fails; usually empty.
        hidden_in_tables: Whether tables leave the finding out, because another one is more
            informative. JSON has it.
        involves_scene: Whether one body of a pair is an object of the scene.
        bodies: Names of the bodies of a pair.
    """

    group: str
    subject: Subject
    name: str
    quantity: str
    verdict: Verdict
    fact: str
    value: float | None = None
    limit: float | None = None
    margin: float | None = None
    unit: str = ""
    time: float | None = None
    interval: tuple[float, float] | None = None
    intervals: tuple[tuple[float, float], ...] = ()
    proof: Proof = "exact"
    proof_gap: float = 0.0
    requested: tuple[float, ...] | None = None
    achieved: tuple[float, ...] | None = None
    points: tuple[tuple[float, ...], ...] = ()
    short_fact: str = ""
    remedy: str = ""
    highlight: str = ""
    hidden_in_tables: bool = False
    involves_scene: bool = False
    bodies: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse wrong values; complete intervals; drop an unproved margin, raise a met one to 0.

        Raises:
            InputError: The verdict, the proof or the subject is unknown, or the value is NaN.
        """
        subject = f"a finding on {self.quantity!r} of {self.subject} {self.name!r}"
        for name, kind in (("verdict", Verdict), ("proof", Proof), ("subject", Subject)):
            word = getattr(self, name)
            if word not in get_args(kind):
                accepted = ", ".join(get_args(kind))
                raise InputError(
                    f"{subject} has the {name} {format_value(word)}; accepted: {accepted}"
                )
        if self.proof == "sampled" and (self.margin or 0.0) >= 0.0:
            object.__setattr__(self, "margin", None)
        elif self.verdict == "met" and self.margin is not None:
            object.__setattr__(self, "margin", max(self.margin, 0.0))
        if self.interval is not None and not self.intervals:
            object.__setattr__(self, "intervals", (self.interval,))
        if self.value is not None and math.isnan(self.value):
            raise InputError(
                f"{subject} has the value NaN; accepted: a number, infinity for a jump, or None"
            )

    @property
    def ok(self) -> bool:
        """Whether the finding does not fail."""
        return self.verdict in PASSING_VERDICTS

    @property
    def is_decided(self) -> bool:
        """Whether the finding is on a requirement that is known to be met or to fail."""
        return self.verdict in ("met", "failed")

    required = OldAttribute("is_decided")
    form = OldAttribute("component_names")

    @property
    def only_sampled(self) -> bool:
        """Whether the requirement is met at samples only."""
        return self.verdict == "met" and self.proof == "sampled"

    @property
    def quantity_text(self) -> str:
        """The quantity in words."""
        return self.quantity.replace("_", " ")

    @property
    def shown_time(self) -> float | None:
        """Time to show [s], the worst one or the start of the interval; `None` for all time."""
        return self.interval[0] if self.time is None and self.interval else self.time

    @property
    def time_text(self) -> str:
        """The worst time, or else the interval, in seconds with three decimals."""
        if self.time is None and self.interval is not None:
            return "{:.3f} to {:.3f}".format(*self.interval)
        return "" if self.time is None else f"{self.time:.3f}"

    @property
    def utilisation(self) -> float | None:
        """Value relative to the limit; `None` if undefined.

        It is also `None` if only samples keep the limit. It is infinite at a jump. On the other
        side of zero it is infinite beyond the limit, and otherwise zero.
        """
        if self.value is None or not self.limit:
            return None
        if self.proof == "sampled" and self.margin is None:
            return None
        if self.is_across_zero:
            return 0.0 if (self.margin or 0.0) > 0.0 else math.inf
        ratio = abs(self.value / self.limit)
        from_below = self.margin is not None and (ratio - 1.0) * self.margin > 0.0
        return 1.0 / ratio if from_below and ratio else ratio

    @property
    def is_across_zero(self) -> bool:
        """Whether zero is between the value and the limit, unless the limit is one of sizes."""
        value, limit, margin = self.value or 0.0, self.limit or 0.0, self.margin or 0.0
        return value * limit < 0.0 and (margin < 0.0 or margin > abs(limit))

    @property
    def message(self) -> str:
        """The finding as one sentence, with the remedy at its end."""
        return f"{self.fact}; {self.remedy}" if self.remedy else self.fact

    @property
    def component_names(self) -> str:
        """Components of requested and achieved, if these are not in the unit of the value."""
        return "x, y, z, w" if self.requested and self.quantity == "orientation" else ""

    def to_dict(self) -> dict[str, Any]:
        """Return the finding as plain data, ready for JSON; infinite numbers become `None`."""
        data = {key: value for key, value in asdict(self).items() if key not in NOT_IN_DATA}
        data |= {"ok": self.ok, "message": self.message, "form": self.component_names}
        return {key: _json_value(value) for key, value in data.items()}

    def __str__(self) -> str:
        return self.message


class Topic(NamedTuple):
    """The subject of findings, and their heading in the report.

    >>> topic = Topic("Joint limits", "joint", "elbow")
    >>> topic.at_most("velocity", "the elbow turns at 3 rad/s, limit 2", 3.0, 2.0, "rad/s").verdict
    'failed'

    Attributes:
        group: Heading.
        subject: Kind of subject.
        name: Name of the subject.
    """

    group: str
    subject: Subject = "motion"
    name: str = ""

    def finding(
        self, quantity: str, fact: str, verdict: Verdict = "information", **more: Any
    ) -> Finding:
        """Make a finding, by default without a requirement.

        Args:
            quantity: Quantity.
            fact: The finding as one sentence.
            verdict: Verdict.
            more: Other attributes of `Finding`.
        """
        return Finding(*self, quantity, verdict, fact, **more)

    def at_most(
        self,
        quantity: str,
        fact: str,
        value: float,
        limit: float,
        unit: str,
        *,
        required: bool = True,
        **more: Any,
    ) -> Finding:
        """Compare the size of a value with its upper limit.

        Args:
            quantity: Quantity.
            fact: The finding as one sentence.
            value: The value, in the SI unit.
            limit: The limit.
            unit: SI unit of both.
            required: Whether a larger value fails; otherwise the finding is information.
            more: Other attributes of `Finding`.
        """
        margin = limit - abs(value)
        verdict = verdict_on(abs(value) <= limit, required=required)
        numbers = {"value": value, "limit": limit, "margin": margin, "unit": unit}
        return self.finding(quantity, fact, verdict, **numbers, **more)

    def at_least(
        self, quantity: str, fact: str, value: float, limit: float, unit: str, **more: Any
    ) -> Finding:
        """Compare a value with its lower limit; arguments as in `at_most`."""
        numbers = {"value": value, "limit": limit, "margin": value - limit, "unit": unit}
        return self.finding(quantity, fact, verdict_on(value >= limit), **numbers, **more)


Findings: TypeAlias = Iterator[Finding]
"""Findings of a check, made one by one."""


def unite_intervals(spans: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Merge overlapping time intervals, in order."""
    merged: list[tuple[float, float]] = []
    for start, end in sorted(spans):
        if merged and start <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(merged[-1][1], end)
        else:
            merged.append((start, end))
    return merged


def verdict_on(ok: bool, *, required: bool = True) -> Verdict:
    """Verdict on a requirement, or on a value without one."""
    if not required:
        return "information"
    return "met" if ok else "failed"


def _json_value(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_json_value(item) for item in value]
    return value
