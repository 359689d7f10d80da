"""The report: findings of the check, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from knotwork.errors import CheckFailedError
from knotwork.units import Units
from knotwork.verification.brief import (
    INDENT,
    NOTABLE,
    BriefLine,
    group_lines,
    used,
    worst_lines,
    wrapped,
)
from knotwork.verification.finding import TRIED, Finding

VERSION = 2
"""Version of `report.json`. Version 1 had no number, and a list for each kind of check."""

WIDTH = 80
MOST_FAILURE_LINES = 8
MOST_WARNING_LINES = 4


@dataclass(frozen=True, repr=False)
class Report:
    """The verdict on a trajectory, finding by finding; printed, it is a few lines.

    >>> import knotwork as kw
    >>> report = kw.plan("paper_case").report
    >>> report.ok, len(report.failures)
    (True, 0)
    >>> [found.name for found in report.select(quantity="joint_position")][:2]
    ['A', 'B']

    Attributes:
        scenario: Name of the scenario.
        robot: Name of the robot, or `None`.
        planner: Planner of the trajectory, as stored in it.
        start_time, end_time: Start and end of the trajectory [s].
        findings: All findings, in the order of the checks.
        units: Units of the scenario, for text; findings are in SI.
    """

    scenario: str
    robot: str | None
    planner: str
    start_time: float
    end_time: float
    findings: tuple[Finding, ...]
    units: Units = field(default_factory=Units)

    def __str__(self) -> str:
        """The verdict and the tightest cases, in some 15 lines of 80 characters."""
        return "\n".join(line.text for line in self.brief())

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        import html

        return f"<pre>{html.escape(str(self))}</pre>"

    @property
    def ok(self) -> bool:
        """Whether nothing fails."""
        return all(found.ok for found in self.findings)

    @property
    def failures(self) -> tuple[Finding, ...]:
        """Findings that fail, in the order of the report."""
        return tuple(found for found in self.findings if not found.ok)

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """Warnings of plausible mistakes; they never fail."""
        return tuple(found for found in self.findings if found.verdict == "warning")

    @property
    def sampled(self) -> tuple[Finding, ...]:
        """Findings that are met at samples only."""
        return tuple(found for found in self.findings if found.only_sampled)

    @property
    def tried(self) -> tuple[Finding, ...]:
        """Findings that list remedies already tried."""
        return tuple(found for found in self.findings if found.quantity == TRIED)

    @property
    def groups(self) -> dict[str, list[Finding]]:
        """Findings by their group, in the order of the report."""
        groups: dict[str, list[Finding]] = {}
        for found in self.findings:
            groups.setdefault(found.group, []).append(found)
        return groups

    @property
    def counts(self) -> tuple[int, int]:
        """Numbers of requirements met, and of requirements."""
        required = [found for found in self.findings if found.required]
        return sum(found.ok for found in required), len(required)

    @property
    def tightest(self) -> tuple[Finding, ...]:
        """The finding with the largest use of its limit for each requirement met, largest first.

        >>> report = kw.plan("ur5_deburring").report
        >>> [f"{found.title} {found.use:.0%}" for found in report.tightest[:2]]
        ['tool speed 81%', 'position 77%']
        """
        worst: dict[tuple[str, str], tuple[float, Finding]] = {}
        for found in self.findings:
            key, use = (found.subject, found.quantity), found.use
            if found.verdict != "met" or use is None or found.detail:
                continue
            if key not in worst or use > worst[key][0]:
                worst[key] = use, found
        order = sorted(worst.values(), key=lambda pair: -pair[0])
        return tuple(found for _, found in order)

    @property
    def reservations(self) -> str:
        """Text of the numbers of undecided and only sampled requirements; mostly empty."""
        undecided = sum(found.verdict == "undecided" for found in self.findings)
        counted = {"undecided": undecided, "sampled only": len(self.sampled)}
        return "".join(f", {count} {what}" for what, count in counted.items() if count)

    @property
    def summary(self) -> str:
        """One line with the number of requirements met and the tightest case.

        >>> kw.plan("ur5_deburring").report.summary
        '102 of 102 met; tightest 81 %: ...'
        """
        met, required = self.counts
        tight = [one for one in self.tightest if (one.use or 0.0) >= NOTABLE]
        tightest = f"; tightest {used(tight[0], self.units)}" if tight and self.ok else ""
        return f"{met} of {required} met{self.reservations}{tightest}"

    def brief(self, width: int = WIDTH) -> list[BriefLine]:
        """The report in some 15 lines: the verdict, failures, the tightest case of each group.

        Args:
            width: Width of the lines in characters, exceeded only by longer words.
        """
        met, required = self.counts
        failed = f", {required - met} failed" if required > met else ""
        verdict = (
            f"{'PASSED' if self.ok else 'FAILED'} {self.scenario}: {met} of {required} "
            f"requirements met{failed}{self.reservations}; {self.end_time - self.start_time:.5g} s"
        )
        lines = wrapped("passed" if self.ok else "failed", verdict, width, INDENT)
        for kind, mark, findings, most in (
            ("failure", "FAIL ", self.failures, MOST_FAILURE_LINES),
            ("tried", "", self.tried, MOST_FAILURE_LINES),
            ("sampled", "not proved: ", self.sampled, MOST_WARNING_LINES),
            ("warning", "warning: ", self.warnings, MOST_WARNING_LINES),
        ):
            lines += worst_lines(kind, mark, findings, most, self.units, width)
        return [*lines, *group_lines(self.groups, self.units, width, ok=self.ok)]

    def select(self, **wanted: object) -> tuple[Finding, ...]:
        """Find findings by their attributes, for example `subject="joint", quantity="velocity"`.

        Raises:
            AttributeError: A finding has no such attribute.
        """
        return tuple(
            found
            for found in self.findings
            if all(getattr(found, key) == value for key, value in wanted.items())
        )

    def to_dict(self) -> dict[str, Any]:
        """Give the report as plain data, ready for JSON."""
        return {
            "version": VERSION,
            "ok": self.ok,
            "failures": [str(found) for found in self.failures],
            "warnings": [str(found) for found in self.warnings],
            "sampled": [str(found) for found in self.sampled],
            "tried": [str(found) for found in self.tried],
            "scenario": self.scenario,
            "robot": self.robot,
            "planner": self.planner,
            "start_time": self.start_time,
            "end_time": self.end_time,
            "findings": [found.to_dict() for found in self.findings],
        }

    def raise_if_failed(self) -> None:
        """Raise an error if a requirement is not met; for use in tests.

        Raises:
            CheckFailedError: A requirement fails; the error lists all failures and is an
                `AssertionError`, too.
        """
        failures = self.failures
        if failures:
            lines = "\n".join(f"  {failure}" for failure in failures)
            raise CheckFailedError(self, f"{self.scenario}: {len(failures)} failed:\n{lines}")
