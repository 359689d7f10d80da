"""Pytest plugin: the fixture `knotwork`, which checks scenarios and trajectories in tests.

    def test_cell(knotwork):
        knotwork.check("*.yaml")

Pytest loads it if Knotwork is installed.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from knotwork.verification import Report


class Checks:
    """The object of the fixture `knotwork`.

    Args:
        folder: Folder of the test; paths are relative to it.
        subtests: Pytest's fixture of this name.
    """

    def __init__(self, folder: Path, subtests: pytest.Subtests) -> None:
        self._folder, self._subtests = folder, subtests

    def check(
        self,
        *patterns: str,
        scenario: str | None = None,
        robot: str | None = None,
        scene: str | None = None,
        limits: Any = None,
    ) -> list[Report]:
        """Plan scenarios, or read trajectories, and check them.

        Each group of requirements is a subtest, which fails with the text of the report.

        Args:
            patterns: Files, with `*` and `**`, or names of shipped scenarios.
            scenario: Scenario of trajectories; by default the one that the report in their folder
                states.
            robot: Name or file of the robot of trajectories without a scenario.
            scene: Scene of trajectories without a scenario: a scenario file, whose waypoints are
                ignored.
            limits: Limits of trajectories without a scenario, in place of those of robot and scene.

        Returns:
            The reports, in the order of the files.
        """
        reports: list[Report] = []
        for file in [file for pattern in patterns for file in self._matching_files(pattern)]:
            name = Path(file).name
            with self._subtests.test(msg=name):
                reports.append(self._check_file(file, scenario, robot, scene, limits))
                groups = reports[-1].groups
                for group, findings in groups.items():
                    if any(finding.is_decided for finding in findings):
                        with self._subtests.test(msg=f"{name}: {group}"):
                            _fail_if_any(findings)
        return reports

    def _matching_files(self, pattern: str) -> list[str]:
        from knotwork.files.documents import resources

        files = sorted(self._folder.glob(pattern))
        if not files and pattern not in resources.names("scenarios"):
            pytest.fail(f"no file matches {pattern!r} in {self._folder}", pytrace=False)
        return [str(file) for file in files] or [pattern]

    def _check_file(
        self, file: str, scenario: str | None, robot: str | None, scene: str | None, limits: Any
    ) -> Report:
        from knotwork import planning
        from knotwork.errors import InputError
        from knotwork.files.foreign import is_trajectory
        from knotwork.files.storage.report_digests import stated_scenario
        from knotwork.planning.check_trajectory import check_with_task

        scenario, robot, scene = (self._resolve(name) for name in (scenario, robot, scene))
        try:
            if robot is not None or scene is not None:
                return planning.check_without_task(file, robot, scene, limits).report
            if scenario is None and not is_trajectory(file):
                return planning.plan(file).report
            stated, note = stated_scenario(Path(file))
            if scenario is None and stated is None:
                raise InputError(note or f"{file} needs its scenario, robot or scene")
            return check_with_task(file, scenario or stated or "").report
        except InputError as error:
            fault = str(error)
        pytest.fail(fault, pytrace=False)

    def _resolve(self, name: str | None) -> str | None:
        """Path of a file in the folder of the test, or else the name itself."""
        path = None if name is None else self._folder / name
        return str(path) if path is not None and path.is_file() else name


def _fail_if_any(findings: Any) -> None:
    from knotwork.verification.brief import finding_lines

    failed = [finding for finding in findings if not finding.ok]
    if failed:
        pytest.fail("\n".join(finding_lines(failed)), pytrace=False)


@pytest.fixture
def knotwork(request: pytest.FixtureRequest, subtests: pytest.Subtests) -> Checks:
    """Check scenarios and trajectories next to a test: `knotwork.check("*.yaml")`."""
    return Checks(request.path.parent, subtests)
