"""The check of a trajectory against its scenario.

The check is independent of planning: it needs only the trajectory and the scenario. It recomputes
joints and tool at the waypoints, during waits and at events; the tool along its paths; the limits
of joints, tool and links; collisions; and continuity.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import CheckFailedError, InputError, UnknownNameError
from knotwork.errors.arguments import require_type
from knotwork.errors.old_names import OldAttribute
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints, read_scenario_joints
from knotwork.units import Units
from knotwork.verification.brief import (
    BRIEF_INDENT,
    NOTABLE_UTILISATION,
    group_alike,
    group_lines,
    requirement_counts,
    utilisation_text,
    worst_lines,
    wrap,
)
from knotwork.verification.checks import CHECKS
from knotwork.verification.finding import REMEDIES_TRIED, Finding, Group, Topic
from knotwork.verification.motion import Motion
from knotwork.waypoints import JointWaypoints

REPORT_VERSION = 2
"""Version of `report.json`. Version 1 had no number, and a list for each kind of check."""
REPORT_WIDTH = 80
"""Width of a short report in characters, which fits into every terminal."""
MAX_FAILURE_KINDS = 5
"""Maximum number of kinds of failures in a short report."""
MAX_WARNING_KINDS = 3
"""Maximum number of kinds of warnings, and of unproved requirements, in a short report."""


def check(
    trajectory: JointTrajectory,
    scenario: Scenario,
    *,
    joints: ScenarioJoints | None = None,
    defects: Sequence[str] = (),
    known: Sequence[Finding] = (),
    without: Sequence[str] = (),
) -> Report:
    """Check a trajectory against a scenario, by every check in `knotwork.verification.CHECKS`.

    Extrema of position, velocity, acceleration and jerk are exact, so these limits are checked over
    all time. Each finding states its kind of proof.

    Args:
        trajectory: The motion, with joints in any order.
        scenario: The scenario.
        joints: The scenario's joints and robot, if already loaded.
        defects: Texts on known faults of the trajectory; each becomes a finding that fails.
        known: Findings that are known already, for the report.
        without: Names of checks to leave out.

    Raises:
        InputError: An argument has another type, a name is that of no check, the trajectory has
            other joints than the scenario, the scenario's robot can't be loaded, or its times are
            to be chosen.

    >>> plan = kw.plan("paper_case")
    >>> kw.check(plan.trajectory, plan.scenario).ok
    True
    """
    require_type(trajectory, JointTrajectory, "trajectory", "a kw.JointTrajectory")
    require_type(scenario, Scenario, "scenario", "a kw.Scenario, as from kw.load_scenario")
    if scenario.unknowns is not None:
        raise InputError(
            f"{scenario.name} leaves times or speeds to planning, so it does not define the motion "
            "over time; accepted: the scenario.yaml saved with the trajectory, or a frozen scenario"
        )
    without = tuple(without)
    for name in without:
        if name not in CHECKS:
            raise UnknownNameError("check", name, CHECKS)
    joints = joints if joints is not None else read_scenario_joints(scenario)
    motion = Motion(trajectory, joints)
    defect_findings = [Topic(Group.MOTION).finding("defect", text, "failed") for text in defects]
    checks = [function for name, function in CHECKS.items() if name not in without]
    by_check = (function(motion, scenario, joints) for function in checks)
    return Report(
        scenario=scenario.name,
        robot=joints.robot.name if joints.robot is not None else None,
        origin=trajectory.origin,
        start_time=trajectory.start_time,
        end_time=trajectory.end_time,
        findings=(*defect_findings, *known, *itertools.chain.from_iterable(by_check)),
        units=scenario.units,
    )


@dataclass(frozen=True, repr=False)
class Report:
    """The findings of a check, and the verdict on the trajectory.

    >>> import knotwork as kw
    >>> report = kw.plan("paper_case").report
    >>> report.ok, len(report.failures)
    (True, 0)
    >>> [finding.name for finding in report.select(quantity="joint_position")][:2]
    ['A', 'B']

    Attributes:
        scenario: Name of the scenario.
        robot: Name of the robot, or `None`.
        origin: Source of the trajectory, see `JointTrajectory.origin`.
        start_time, end_time: Start and end of the trajectory [s].
        findings: All findings, in the order of the checks.
        units: Units of the scenario, for text; findings are in SI.
    """

    scenario: str
    robot: str | None
    origin: str
    start_time: float
    end_time: float
    findings: tuple[Finding, ...]
    units: Units = field(default_factory=Units)

    def __str__(self) -> str:
        """The verdict and the findings nearest to limits, in about 15 lines of 80 characters."""
        return "\n".join(self.brief())

    def __repr__(self) -> str:
        return f"<Report {self.scenario!r}: {self.counts_text}>"

    def _repr_html_(self) -> str:
        import html

        return f"<pre>{html.escape(str(self))}</pre>"

    planner = OldAttribute("origin")

    @property
    def ok(self) -> bool:
        """Whether no requirement fails."""
        return all(finding.ok for finding in self.findings)

    @property
    def failures(self) -> tuple[Finding, ...]:
        """Findings that fail, in the order of the report."""
        return tuple(finding for finding in self.findings if not finding.ok)

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """Warnings of probable mistakes; they never fail."""
        return tuple(finding for finding in self.findings if finding.verdict == "warning")

    @property
    def sampled(self) -> tuple[Finding, ...]:
        """Findings that are met at samples only."""
        return tuple(finding for finding in self.findings if finding.only_sampled)

    @property
    def tried(self) -> tuple[Finding, ...]:
        """Findings on remedies that planning has tried in vain."""
        return tuple(finding for finding in self.findings if finding.quantity == REMEDIES_TRIED)

    @property
    def groups(self) -> dict[str, list[Finding]]:
        """Findings by their group, in the order of the report."""
        groups: dict[str, list[Finding]] = {}
        for finding in self.findings:
            groups.setdefault(finding.group, []).append(finding)
        return groups

    @property
    def counts(self) -> tuple[int, int]:
        """Number of requirements met, and number of all requirements, with undecided ones."""
        return requirement_counts(self.findings)

    @property
    def tightest(self) -> tuple[Finding, ...]:
        """The tightest finding of each kind of requirement that is met, by falling utilisation.

        >>> report = kw.plan("ur5_deburring").report
        >>> [f"{item.quantity_text} {item.utilisation:.0%}" for item in report.tightest[:2]]
        ['tool speed 81%', 'position 77%']
        """
        met = [
            finding
            for finding in self.findings
            if finding.verdict == "met"
            and finding.utilisation is not None
            and not finding.hidden_in_tables
        ]
        worst = [kind[0] for kind in group_alike(met)]
        return tuple(sorted(worst, key=lambda finding: -(finding.utilisation or 0.0)))

    @property
    def notable(self) -> list[Finding]:
        """The findings of `tightest` that use at least `NOTABLE_UTILISATION` of their limits."""
        return [item for item in self.tightest if (item.utilisation or 0.0) >= NOTABLE_UTILISATION]

    @property
    def reservations(self) -> str:
        """Text with the numbers of undecided and of sampled requirements; usually empty."""
        undecided = sum(finding.verdict == "undecided" for finding in self.findings)
        counted = {"undecided": undecided, "sampled only": len(self.sampled)}
        return "".join(f", {count} {word}" for word, count in counted.items() if count)

    @property
    def counts_text(self) -> str:
        """Text with the numbers of met, all, failed, undecided and sampled requirements."""
        met, required = self.counts
        failed = f", {len(self.failures)} failed" if self.failures else ""
        return f"{met} of {required} requirements met{failed}{self.reservations}"

    result = OldAttribute("counts_text")

    @property
    def summary(self) -> str:
        """One line with the number of requirements met and the finding nearest to its limit.

        >>> kw.plan("ur5_deburring").report.summary
        '102 of 102 met; tightest 81 %: ...'
        """
        met, required = self.counts
        text = f"{met} of {required} met{self.reservations}"
        if self.ok and (notable := self.notable):
            text += f"; tightest {utilisation_text(notable[0], self.units)}"
        return text

    def brief(self, width: int = REPORT_WIDTH) -> list[str]:
        """The report in about 15 lines: verdict, failures, and the tightest finding of each group.

        Args:
            width: Width of the lines in characters, exceeded only by longer words.
        """
        verdict = (
            f"{'PASSED' if self.ok else 'FAILED'} {self.scenario}: {self.counts_text}; "
            f"{self.end_time - self.start_time:.5g} s"
        )
        lines = wrap(verdict, width, BRIEF_INDENT)
        for mark, findings, max_kinds in (
            ("FAIL ", self.failures, MAX_FAILURE_KINDS),
            ("", self.tried, MAX_FAILURE_KINDS),
            ("not proved: ", self.sampled, MAX_WARNING_KINDS),
            ("warning: ", self.warnings, MAX_WARNING_KINDS),
        ):
            lines += worst_lines(mark, findings, max_kinds, width)
        return [*lines, *group_lines(self.groups, self.units, width, ok=self.ok)]

    def select(self, **wanted: object) -> tuple[Finding, ...]:
        """Find findings by their attributes, for example `subject="joint", quantity="velocity"`.

        Raises:
            AttributeError: A finding has no such attribute.
        """
        return tuple(
            finding
            for finding in self.findings
            if all(getattr(finding, key) == value for key, value in wanted.items())
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the report as plain data, ready for JSON; `planner` is the origin."""
        return {
            "version": REPORT_VERSION,
            "ok": self.ok,
            "failures": [str(finding) for finding in self.failures],
            "warnings": [str(finding) for finding in self.warnings],
            "sampled": [str(finding) for finding in self.sampled],
            "tried": [str(finding) for finding in self.tried],
            "scenario": self.scenario,
            "robot": self.robot,
            "planner": self.origin,
            "start_time": self.start_time,
            "end_time": self.end_time,
            "findings": [finding.to_dict() for finding in self.findings],
        }

    def raise_if_failed(self) -> None:
        """Raise an error if a requirement is not met; for use in tests.

        Raises:
            CheckFailedError: A requirement fails. The error lists all failures and is also an
                `AssertionError`.
        """
        failures = self.failures
        if failures:
            lines = "\n".join(f"  {failure}" for failure in failures)
            raise CheckFailedError(self, f"{self.scenario}: {len(failures)} failed:\n{lines}")


@dataclass(frozen=True, eq=False)
class CheckedMotion:
    """A motion with its scenario and the verdict on it.

    Attributes:
        scenario: The scenario.
        joints: The joints that the scenario moves, their robot and the requirements on them.
        joint_waypoints: Joint positions and velocities at the waypoints; `None` if they are
            unknown, as for a motion from a file.
        trajectory: The motion.
        report: Findings of the check.
    """

    scenario: Scenario
    joints: ScenarioJoints
    joint_waypoints: JointWaypoints | None
    trajectory: JointTrajectory
    report: Report

    space = OldAttribute("joints")


AnyMotion: TypeAlias = CheckedMotion | JointTrajectory
"""A motion with or without its check."""
