"""How near four curves keep the tool to a path, over the number of points given to them.

Two paths: a UR5's line of 300 mm at 50 mm/s and an xArm7's circle of 80 mm diameter at 30 mm/s. All
curves go through the same points, spread evenly: the joints' positions, velocities and
accelerations on the path. Each takes what it can: modified and quintic Hermite all three, cubic
Hermite positions and velocities, and the B-spline positions, with the velocities at both ends.
The deviation is the largest at 2000 times, by Pinocchio; those of `kw.follow_path` are proved. The
UR5 drives a circle of 80 mm many times round, too, to show what long paths cost.

CppFlow's paths for redundant arms, and a dome whose points leave the turn of the tool free, or not,
are planned as scenarios.

With `--save benchmarks/results` the results are saved there; `--figure FILE` draws them.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from scipy.interpolate import BPoly, CubicHermiteSpline, make_interp_spline

import knotwork as kw
import path_problems
import results
from knotwork.curves.tool_paths import TimedPath, ToolPath
from knotwork.robot.kinematics.following.continuation import compute_rates_on_path, continue_along
from knotwork.units import readable
from knotwork.verification.bounds.path_criteria import PathTolerances, RequiredSpeed
from knotwork.verification.bounds.stretch_bounds import path_bounds
from knotwork.view import save_figure
from knotwork.view.style import DARK, colour, dashes
from results import Table

Arrays = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
CURVES: dict[str, Callable[[Arrays], Callable[[np.ndarray], np.ndarray]]] = {
    "modified Hermite": lambda p: kw.ModifiedHermiteSpline(*p[:3], acceleration=p[3]),
    "cubic Hermite": lambda p: CubicHermiteSpline(*p[:3]),
    "quintic Hermite": lambda p: BPoly.from_derivatives(p[0], np.stack(p[1:], axis=1)),
    "B-spline": lambda p: make_interp_spline(
        p[0], p[1], 3, bc_type=([(1, p[2][0])], [(1, p[2][-1])])
    ),
}
POINTS = (3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 48, 64)
SAMPLES, TICKS = 2000, (3, 5, 10, 20, 40, 64)
# How often the circle of a long path is driven round, and how near to it [m].
TURNS, NEAR = (1, 4, 16, 64, 128), 1e-5
# Deviations below this are not told from rounding [mm].
ROUNDING = 1e-6


def cases() -> dict[str, tuple[kw.Robot, np.ndarray, TimedPath, float, float]]:
    """Arm, start, path over time, speed [m/s] and tolerance [m]."""
    tp = kw.tool_paths
    ur5, xarm7 = kw.load_robot("ur5"), kw.load_robot("xarm7")
    home = ur5.configuration("home")
    bent = np.array([0.0, -0.3, 0.0, 0.8, 0.0, 1.1, 0.0])
    at, half = ur5.forward(home).translation, np.array([0.0, 0.15, 0.0])
    line = tp.Line(at - half, at + half)
    point = xarm7.forward(bent).translation
    circle = tp.Arc.about(point, point + np.array([0.0, 0.04, 0.0]), point, [0, 0, 1])
    found = {}
    for name, arm, q, curve, speed, tolerance in (
        ("UR5, line of 300 mm at 50 mm/s", ur5, home, line, 0.05, 1e-5),
        ("xArm7, circle of 80 mm at 30 mm/s", xarm7, bent, circle, 0.03, 5e-6),
    ):
        rotation = arm.forward(q).rotation
        path = ToolPath([curve], tp.OrientationCurve.constant(rotation, curve.length))
        timing = tp.speed_profile([curve.length], [speed], acceleration=1.0)
        start = kw.solve_pose_ik(arm, path.pose(0.0), q).q
        found[name] = (arm, start, TimedPath(path, timing), speed, tolerance)
    return found


def deviation(arm: kw.Robot, motion: TimedPath, curve: Callable[..., np.ndarray]) -> float:
    """Largest distance from the path at many times [m]."""
    times = np.linspace(0.0, motion.end_time, SAMPLES)
    points = np.array([arm.forward(q).translation for q in curve(times)])
    near = motion.tool_path.nearest(points, motion.arc_length(times))
    return float(np.linalg.norm(points - motion.tool_path.position(near), axis=1).max())


def compared(case: str, arm: kw.Robot, start: np.ndarray, motion: TimedPath) -> list[Any]:
    """Deviation of each curve [mm] for each number of points."""
    rows = []
    for count in POINTS:
        times = np.linspace(0.0, motion.end_time, count)
        path = continue_along(arm, motion, start[None], times, step=0.02)
        q = path.position[path.step_index, 0]
        rates = np.empty((2, *q.shape))
        for side, own in (("right", slice(0, -1)), ("left", slice(-1, None))):
            rates[:, own] = compute_rates_on_path(arm, motion, q[own], times[own], side)
        arrays = (times, q, rates[0], rates[1])
        off = {
            name: float(f"{1e3 * deviation(arm, motion, make(arrays)):.3g}")
            for name, make in CURVES.items()
        }
        rows.append({"case": case, "points": count, "deviation_mm": off})
    return rows


def proved(
    case: str, arm: kw.Robot, start: np.ndarray, motion: TimedPath, speed: float, tolerance: float
) -> dict[str, Any]:
    """What `kw.follow_path` makes of a path, with proved bounds."""
    path = motion.tool_path
    curve = kw.follow_path(arm, path, speed, tolerance, start=start, speed_tolerance=1e-3)
    whole = motion.start_time, motion.end_time
    allowed = PathTolerances(tolerance, np.radians(0.1), RequiredSpeed(speed, 1e-3 * speed, whole))
    bounds = path_bounds(arm, curve.polynomial, motion, whole, allowed)
    found = bounds.worst_errors
    times = curve.waypoint_times
    if times is None or not (found["path_deviation"].proved and found["path_speed"].proved):
        raise SystemExit(f"{case}: not proved")
    return {
        "case": case,
        "tolerance_mm": 1e3 * tolerance,
        "inserted": len(times) - 2,
        "bound_mm": float(f"{1e3 * found['path_deviation'].bound:.3g}"),
        "slowest_mm_s": float(f"{1e3 * bounds.errors.slowest:.6g}"),
        "fastest_mm_s": float(f"{1e3 * bounds.errors.fastest:.6g}"),
    }


def long_paths() -> list[Any]:
    """What many turns of a circle cost: length [m], waypoints inserted and seconds of CPU."""
    arm = kw.load_robot("ur5")
    home = arm.configuration("home")
    at = arm.forward(home).translation
    centre, rows = at - np.array([0.04, 0.0, 0.0]), []
    for turns in TURNS:
        circle = kw.tool_paths.Arc.about(at, centre, at, [0, 0, 1], turns - 1)
        begun = time.process_time()
        motion = kw.follow_path(arm, circle, 0.05, NEAR, start=home)
        taken = time.process_time() - begun
        inserted = 0 if motion.waypoint_times is None else len(motion.waypoint_times) - 2
        rows.append(
            {
                "length_m": float(f"{circle.length:.3g}"),
                "inserted": inserted,
                "cpu_s": float(f"{taken:.2g}"),
            }
        )
    return rows


def planned() -> list[Any]:
    """What plans of CppFlow's paths and of a dome make of what is free."""
    measured = path_problems.measured
    rows = [
        measured(f"{name}, {arm.robot}", path_problems.problem(name))
        for name, arm in path_problems.ARMS.items()
    ]
    with tempfile.TemporaryDirectory() as folder:
        for case, free in (("dome, turn free, ur5", True), ("dome, nothing free, ur5", False)):
            rows.append(measured(case, path_problems.dome(Path(folder), free=free)))
    return rows


def slope(rows: list[Any], curve: str) -> float:
    """How the deviation falls with the number of intervals: the last exponent above rounding."""
    known = [(r["points"] - 1, r["deviation_mm"][curve]) for r in rows]
    (n, a), (m, b) = [(count, off) for count, off in known if off > ROUNDING][-2:]
    return float(np.log(a / b) / np.log(m / n))


def tables(data: dict[str, Any]) -> list[Table]:
    """A table of the proved motions, and one for each path."""
    head = ("path", "tolerance mm", "inserted", "proved mm", "proved mm/s")
    cells = [
        [
            one["case"],
            f"{one['tolerance_mm']:g}",
            str(one["inserted"]),
            f"{one['bound_mm']:g}",
            f"{one['slowest_mm_s']:g} to {one['fastest_mm_s']:g}",
        ]
        for one in data["followed"]
    ]
    made = [Table("Motions of kw.follow_path", head, cells)]
    for one in data["followed"]:
        rows = [row for row in data["rows"] if row["case"] == one["case"]]
        cells = [
            [str(r["points"]), *(f"{value:g}" for value in r["deviation_mm"].values())]
            for r in rows
        ]
        cells.append(["order", *(f"{slope(rows, name):.1f}" for name in CURVES)])
        made.append(Table(one["case"], ("points", *CURVES), cells, note="(deviation in mm)"))
    cells = [[f"{r['length_m']:g}", str(r["inserted"]), f"{r['cpu_s']:g}"] for r in data["long"]]
    note = f"(UR5, tolerance {1e3 * NEAR:g} mm)"
    made.append(
        Table("Many turns of a circle", ("length m", "inserted", "CPU s"), cells, note=note)
    )
    wide = ("path", "passes", "proved mm", "proved deg", "last joint deg", "peak deg/s", "CPU s")
    cells = [
        [
            one["case"],
            "yes" if one["passed"] else "no",
            *(f"{one[key]:g}" for key in list(one)[2:]),
        ]
        for one in data["planned"]
    ]
    made.append(Table("Plans with freedom along the path", wide, cells))
    return made


def figure(data: dict[str, Any], file: Path) -> None:
    """Draw deviation over the number of points, a panel for each path."""
    from matplotlib.figure import Figure

    made = Figure(figsize=(9, 4), layout="constrained")
    panels = made.subplots(1, len(data["followed"]), sharey=True)
    for panel, one in zip(panels, data["followed"], strict=True):
        rows = [row for row in data["rows"] if row["case"] == one["case"]]
        points = [row["points"] for row in rows]
        for i, name in enumerate(CURVES):
            look = {"marker": ".", "color": colour(i), "linestyle": dashes(i)}
            panel.loglog(points, [r["deviation_mm"][name] for r in rows], label=name, **look)
        panel.axhline(one["tolerance_mm"], color=DARK, linewidth=0.8)
        panel.set(title=one["case"], xlabel="points")
        panel.set_xticks(TICKS, map(str, TICKS))
        panel.set_xticks([], minor=True)
        panel.yaxis.set_major_formatter(lambda value, _: readable(value))
    panels[0].set_ylabel("deviation [mm]")
    panels[0].legend(frameon=False)
    save_figure(made, file)


@click.command()
@results.save_option
@click.option("--figure", "picture", type=click.Path(path_type=Path), help="File to draw to.")
def main(save: Path | None, picture: Path | None) -> None:
    """Compare curves through the same points of two tool paths."""
    rows: list[Any] = []
    followed = []
    for case, (arm, start, motion, speed, tolerance) in cases().items():
        rows += compared(case, arm, start, motion)
        followed.append(proved(case, arm, start, motion, speed, tolerance))
    data = {"followed": followed, "rows": rows, "long": long_paths(), "planned": planned()}
    for table in tables(data):
        table.show(Console(width=140))
    if picture is not None:
        figure(data, picture)
    if save is not None:
        print(results.save(save, "paths", data))


if __name__ == "__main__":
    main()
