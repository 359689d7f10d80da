"""`Plan`: a planned motion with its verdict, which can be shown, saved and changed."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knotwork.curves.trajectory import Event, Segment
from knotwork.errors import InputError
from knotwork.files import storage
from knotwork.files.documents import resources
from knotwork.planning.execution import scaled_motion, stopped_motion
from knotwork.planning.replanning import continued_scenario
from knotwork.planning.task_to_joint import TaskSolution
from knotwork.task import Task
from knotwork.verification.report import CheckedMotion
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.planning.choosing import ChosenValues
    from knotwork.view.page import Page


@dataclass(frozen=True, eq=False)
class Plan(CheckedMotion):
    """A planned motion with its verdict, which can be shown, saved and changed.

    >>> swing = kw.plan("paper_case")
    >>> swing.joint_waypoints.time, swing.trajectory.end_time, swing.report.ok
    (array([ 0.,  5., 15., 25.]), 25.0, True)

    Attributes:
        scenario: The scenario.
        joints: The joints it moves and their robot.
        joint_waypoints: Joint positions and velocities at the waypoints.
        trajectory: The motion.
        report: Findings of the check.
        unsupported_options: Scenario options that were ignored, because the planner passed to
            `plan` does not support them.
        solution: IK solution chosen for each pose.
        chosen_values: Values chosen for the unknowns, numbers in `scenario`; `None` if all
            values were given.
    """

    joint_waypoints: JointWaypoints
    unsupported_options: tuple[str, ...] = ()
    solution: TaskSolution | None = None
    chosen_values: ChosenValues | None = None

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
        return f"<Plan {self.scenario.name!r}: {self.report.counts_text}>"

    def __str__(self) -> str:
        """The report in about 15 lines."""
        return str(self.report)

    def _repr_html_(self) -> str:
        return self.report._repr_html_()

    def report_to_dict(self) -> dict[str, Any]:
        """Convert the report to plain data, with the poses' `solutions` and `chosen_times`."""
        data = self.report.to_dict()
        if self.solution is not None and self.solution.choices:
            data["solutions"] = self.solution.to_dict()
        if self.chosen_values is not None:
            data["chosen_times"] = self.chosen_values.to_dict()
        return data

    def freeze(self, path: str | Path) -> Path:
        """Write the scenario with the chosen times and speeds as numbers, and keep its comments.

        Planning that file gives this motion again.

        Args:
            path: The file to write; an existing one is replaced.

        Raises:
            InputError: All values were given, the file can't be written, or the numbers can't be
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

        if self.chosen_values is None:
            raise InputError(
                f"{self.scenario.name}: all values are given, so none can be frozen; accepted: "
                "a scenario with times: fastest, after: fastest or speed: fastest"
            )
        target = Path(path)
        return storage.write_file(target, frozen_text(self.chosen_values.scenario, target.parent))

    def _scenario_reference(self, folder: Path) -> str | None:
        """Name of a shipped scenario, or its path from a folder; `None` if no file has its times.

        Raises:
            InputError: The file in the folder has this scenario without the chosen times.
        """
        source = self.scenario.source
        if source is None:
            return None
        if self.chosen_values is not None:
            if source.resolve() == (folder / "scenario.yaml").resolve():
                raise InputError(
                    f"{source}: would be replaced by the scenario with its chosen times; accepted: "
                    "another folder"
                )
            return None
        if source.parent == resources.folder("scenarios"):
            return source.stem
        return Path(os.path.relpath(source, folder)).as_posix()

    def save(self, folder: str | Path, *, rate: float | None = None) -> list[Path]:
        """Write `trajectory.json`, `samples.csv` and `report.json` into a folder, each whole.

        The report states the SHA-256 of the other files under `files`, and the path of the scenario
        under `scenario_file`. If times were chosen, or if the scenario has no file, `scenario.yaml`
        is written as well. It has numbers in place of unknown times, and keeps comments.

        Args:
            folder: Created if it does not exist; files of these names in it are replaced.
            rate: Samples per second [Hz]; by default the scenario's.

        Returns:
            Paths of the files.

        Raises:
            InputError: The folder can't be written to, has the scenario itself where times were
                chosen, or the rate makes too many samples.

        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in kw.plan("paper_case").save(folder)]
        ['trajectory.json', 'samples.csv', 'report.json']
        """
        from knotwork.files.export import to_csv

        rate = rate if rate is not None else self.scenario.task.rate
        files = {
            "trajectory.json": storage.json_text(storage.trajectory_to_dict(self.trajectory)),
            "samples.csv": to_csv(self.trajectory, rate=rate),
        }
        scenario_file = self._scenario_reference(Path(folder))
        if scenario_file is None:
            from knotwork.planning.choosing import saved_text

            # a task without a name would take that of scenario.yaml
            scenario = self.scenario if self.chosen_values is None else self.chosen_values.scenario
            named = replace(scenario, task=scenario.task.replace(name=scenario.name))
            files["scenario.yaml"] = saved_text(named, Path(folder))
        report = {
            **self.report_to_dict(),
            "scenario_file": scenario_file or "scenario.yaml",
            "files": storage.digests(files),
        }
        return storage.write_files(folder, {**files, "report.json": storage.json_text(report)})

    def scaled(self, profile: Mapping[float, float]) -> Plan:
        """Execute the same path at another speed.

        Joints deviate from the path by at most 1e-6 rad or m. The check of the new plan covers
        limits, collisions, the poses of the waypoints at their new times, and tool paths without
        their speeds; woven paths are not checked. Other robots keep their own speed.

        Args:
            profile: Speed override by time since the start [s]: 1 is the planned speed. The
                override changes smoothly from each value to the next, and keeps the last one. If it
                is at most 1 and changes too fast for the limits of acceleration and jerk, the
                nearest feasible override found replaces it. A warning of the report states this, or
                that none was found.

        Raises:
            InputError: A time or an override is negative, the arm would not move, or a pose is in a
                moving frame.

        >>> plan = kw.plan("paper_case")
        >>> slow = plan.scaled({0: 1.0, 4: 1.0, 6: 0.5})
        >>> slow.trajectory.duration > plan.trajectory.duration, slow.report.ok
        (True, True)
        """
        return scaled_motion(self, profile)

    def stop(self, at: float, *, on_path: bool = True) -> Plan:
        """Stop as soon as the limits of acceleration and jerk allow.

        Args:
            at: Start of the stop [s].
            on_path: Stay on the path of the motion, within 1e-6 rad or m, and stop at its next rest
                if no stop is sooner. Otherwise each joint stops independently, in minimum time.

        Returns:
            A plan that begins at the time `at`, which is its time 0, with the position, velocity
            and acceleration at that time.

        Raises:
            InputError: The time is outside the motion; a joint has no acceleration limit (or, off
                the path, no jerk limit); the motion ends before it can stop on its path; or it is
                at rest at that time.

        >>> joints = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 2}]
        >>> swing = kw.plan({"limits": {"acceleration": 4, "jerk": 40}, "waypoints": joints})
        >>> stop = swing.stop(1.0)
        >>> stop.report.ok, bool(stop.trajectory.duration < 0.5)
        (True, True)
        """
        return stopped_motion(self, at, on_path=on_path)

    def view(self) -> Page:
        """Show the motion of the arm in 3D.

        A notebook shows the page inline; `save` writes it to a file that any browser opens.

        Raises:
            InputError: The scenario has no robot, or the motion can't be shown.
        """
        from knotwork.view.page import scene_page
        from knotwork.view.scene_data import scene_of

        return scene_page(scene_of(self))

    def play(self, viewer: Any) -> None:
        """Show the motion of the arm in a running Meshcat viewer.

        Robot, path, waypoints, frames and scene are drawn below `knotwork`, in the axes of the
        URDF's root, and the motion starts. Other objects in the viewer stay. A robot that
        Pinocchio's visualizer shows is hidden; `displayVisuals(True)` shows it again.

        Args:
            viewer: A `meshcat.Visualizer`, or Pinocchio's `MeshcatVisualizer`.

        Raises:
            InputError: The viewer is neither, or the scenario has no robot.
        """
        from knotwork.view.meshcat_player import play_scene
        from knotwork.view.scene_data import scene_of

        play_scene(scene_of(self), viewer)

    def replan(self, at: float, scenario: str | Path | Mapping[str, Any] | Task) -> Plan:
        """Plan another task from the state of this motion at a given time.

        That time is time 0 of the new plan. Position, velocity and acceleration continue without a
        jump. The state replaces the `start` of the task, or its first waypoint if the task has
        several waypoints and no `start`. Times in the task, and those of moving frames and other
        robots, count from that time.

        Args:
            at: Time of the state in this motion [s].
            scenario: The new scenario, as for `plan`.

        Raises:
            InputError: The time is outside the motion, the tool holds an object that the task does
                not hold, or the task is wrong as in `plan`.
        """
        from knotwork.planning import plan

        return plan(continued_scenario(self.trajectory, at, scenario, self.scenario))
