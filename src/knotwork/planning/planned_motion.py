"""A planned motion with its verdict, as an object, as files and as plain data."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knotwork.errors import InputError
from knotwork.files import storage
from knotwork.files.documents import resources
from knotwork.planning.task_to_joint import TaskSolution
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.spline.trajectory import Event, JointTrajectory, Segment
from knotwork.verification import Report
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.planning.choosing import ChosenTimes


@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """A scenario, its waypoints at the joints, the trajectory through them, and the verdict.

    Attributes:
        scenario: The task.
        space: The joints it moves and their robot.
        joint_waypoints: Joint positions and velocities at the waypoints.
        trajectory: The motion.
        report: Findings of the check.
        left_out: Options of the scenario that are not supported by a planner given in place of its
            own.
        solution: Choice of the solutions of the poses.
        chosen: Chosen values of a scenario with free times; `scenario` then has them as numbers.
            `None` if no value was free.
        sequences: Number of planned sequences of solutions. The last one is collision-free, or all
            collide.
    """

    scenario: Scenario
    space: JointSpace
    joint_waypoints: JointWaypoints
    trajectory: JointTrajectory
    report: Report
    left_out: tuple[str, ...] = ()
    solution: TaskSolution | None = None
    chosen: ChosenTimes | None = None
    sequences: int = 1

    @property
    def events(self) -> tuple[Event, ...]:
        """Switching events, in order of time."""
        return self.trajectory.events

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Parts of the motion, in order of time.

        >>> [(part.name, part.kind) for part in kw.plan("paper_case").segments][:2]
        [('A to B', 'free motion'), ('B to C', 'free motion')]
        """
        return self.trajectory.segments

    def __repr__(self) -> str:
        """The report in short."""
        return str(self.report)

    def _repr_html_(self) -> str:
        return self.report._repr_html_()

    def report_to_dict(self) -> dict[str, Any]:
        """Convert the report to plain data, with the choice of the poses' `solutions`."""
        data = self.report.to_dict()
        if self.solution is not None and self.solution.choices:
            data["solutions"] = self.solution.to_dict()
        if self.chosen is not None:
            data["chosen_times"] = self.chosen.to_dict()
        return data

    def freeze(self, path: str | Path) -> Path:
        """Write the scenario with the chosen times and speeds as numbers, and keep its comments.

        Planning that file gives this motion again.

        Args:
            path: The file to write; an existing one is replaced.

        Raises:
            InputError: No value was free, the file can't be written, or the numbers can't be
                written into the text of the scenario.

        >>> import tempfile
        >>> joints = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": "fastest"}]
        >>> swing = kw.plan({"limits": {"acceleration": 4}, "waypoints": joints})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     again = kw.plan(swing.freeze(Path(folder) / "frozen.yaml"))
        >>> again.trajectory.duration == swing.trajectory.duration
        True
        """
        from knotwork.planning.choosing import frozen_text

        if self.chosen is None:
            raise InputError(
                f"{self.scenario.name}: nothing is free, so there is nothing to freeze; accepted: "
                "a scenario with times: fastest, after: fastest or a free speed"
            )
        target = Path(path)
        return storage.write_file(target, frozen_text(self.chosen.scenario, target.parent))

    def _scenario_file(self, folder: Path) -> str:
        """Name of a shipped scenario, or its relative path from a folder."""
        source = self.scenario.source
        if self.chosen is not None or source is None:
            return "scenario.yaml"
        if source.parent == resources.folder("scenarios"):
            return source.stem
        return Path(os.path.relpath(source, folder)).as_posix()

    def save(self, folder: str | Path, *, rate: float | None = None) -> list[Path]:
        """Write `trajectory.json`, `samples.csv` and `report.json` into a folder, each whole.

        The report states the SHA-256 of the other two under `files`, and the path of the scenario
        under `scenario_file`. If times were chosen, or if the scenario has no file, `scenario.yaml`
        is written as well. It has numbers in place of free times, and keeps comments.

        Args:
            folder: Created if it does not exist; files of these names in it are replaced.
            rate: Samples per second [Hz]; by default the scenario's.

        Returns:
            Paths of the files.

        Raises:
            InputError: The folder can't be written to, or the rate makes too many samples.

        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in kw.plan("paper_case").save(folder)]
        ['trajectory.json', 'samples.csv', 'report.json']
        """
        from knotwork.export import to_csv

        rate = rate if rate is not None else self.scenario.task.rate
        files = {
            "trajectory.json": storage.to_json(storage.trajectory_to_dict(self.trajectory)),
            "samples.csv": to_csv(self.trajectory, rate=rate),
        }
        if self._scenario_file(Path(folder)) == "scenario.yaml":
            from knotwork.planning.choosing import saved_text

            # whose name differs from that of the new file
            asked = self.scenario if self.chosen is None else self.chosen.scenario
            named = replace(asked, task=asked.task.replace(name=asked.name))
            files["scenario.yaml"] = saved_text(named, Path(folder))
        report = {
            **self.report_to_dict(),
            "scenario_file": self._scenario_file(Path(folder)),
            "files": storage.digests(files),
        }
        return storage.write_files(folder, {**files, "report.json": storage.to_json(report)})
