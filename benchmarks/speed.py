"""How long single plans take, before and after a change: two checkouts side by side in one run.

    git worktree add /tmp/before COMMIT
    python benchmarks/speed.py --before /tmp/before [--save benchmarks/results]

Each checkout has a process of its own in each round; they take turns. Times are those of the
processor, with one thread; the least of all rounds counts, which other work on the machine hardly
changes. Cold starts have as many threads as users have, and are told by the clock too. Ratios are
what to look at.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from rich.console import Console

import results
from results import Table

if TYPE_CHECKING:  # its import is measured
    from knotwork import Robot
    from knotwork.arrays import FloatArray

ROOT = Path(__file__).parents[1]
WAYPOINTS = 10
LONG = 300
SPLINES = (4, 10, 100, 1_000, 1_000_000)
# Times at which curves of so many waypoints are evaluated.
SAMPLES = {100: (1, 10, 100, 1_000, 10_000, 100_000), 10_000: (1_000, 10_000, 100_000)}
JOINTS = 6
# What is measured: what it is called, and what it is to take at most [ms].
CASES: dict[str, tuple[str, float | None]] = {
    "ten": (f"ur5, {WAYPOINTS} poses passed at speed", 40.0),
    "panda": (f"panda, {WAYPOINTS} poses passed at speed", 100.0),
    "joints": (f"ur5, {WAYPOINTS} joint waypoints: torque, collisions and tool proved", None),
    "paper_case": ("`paper_case`: joint waypoints without a robot", 3.0),
    "ur5_deburring": ("`ur5_deburring`: a tool path among objects", 40.0),
    "panda_pick_place": ("`panda_pick_place`: a vial held among objects", 100.0),
    "far": ("ur5, one of ten poses out of reach: refused", 50.0),
    "far_panda": ("panda, one of ten poses out of reach: refused", 50.0),
    "long": (f"panda, {LONG} poses passed at speed", None),
    "all": ("`solve_pose_ik_all` of a ur5, mean of 20 poses", 5.0),
    "all_search": ("`solve_pose_ik_all` of a talos_arm, mean of 20 poses", 5.0),
}
MOST_STARTS = 2.2


def poses(robot: Robot, n: int) -> list[dict[str, Any]]:
    """Waypoints at poses along a smooth way around home, passed at 54 mm/s."""
    import pinocchio as pin

    home, waypoints = robot.configurations["home"], []
    for i in range(n):
        pose = robot.forward(home + 0.5 * np.sin(7.0 / n * i + np.arange(robot.dof)))
        turn = pin.Quaternion(pose.rotation).coeffs().tolist()
        placed = {"position": pose.translation.tolist(), "quaternion_xyzw": turn}
        passed = {"velocity": {"linear": [0.05, 0.02, 0.0]}} if 0 < i < n - 1 else {}
        waypoints.append({"time": 2.0 * i, "pose": placed, **passed})
    return waypoints


def tasks() -> dict[str, Callable[[], object]]:
    """What is measured, by name."""
    import knotwork as kw

    ur5, panda, talos = (kw.load_robot(name) for name in ("ur5", "panda", "talos_arm"))
    rng, home = np.random.default_rng(2), ur5.configurations["home"]

    def planned(task: Any) -> Callable[[], object]:
        return lambda: kw.plan(task)

    def refused(robot: str, waypoints: list[dict[str, Any]]) -> Callable[[], object]:
        waypoints[4]["pose"]["position"] = [2.0, 0.0, 0.5]

        def run() -> object:
            try:
                return kw.plan({"robot": robot, "waypoints": waypoints})
            except kw.InputError as error:
                return error

        return run

    def solved(robot: Robot) -> Callable[[], object]:
        low = np.maximum(robot.limits.lower, -3.0)
        high = np.minimum(robot.limits.upper, 3.0)
        asked = [robot.forward(rng.uniform(low, high)) for _ in range(20)]
        return lambda: [kw.solve_pose_ik_all(robot, pose) for pose in asked]

    moves = [home + 0.3 * np.sin(i + np.arange(6)) for i in range(WAYPOINTS)]
    joints = [
        {
            "time": 2.0 * i,
            "joints": dict(zip(ur5.joint_names, q.tolist(), strict=True)),
            **({"velocity": {ur5.joint_names[0]: 0.05}} if 0 < i < WAYPOINTS - 1 else {}),
        }
        for i, q in enumerate(moves)
    ]
    return {
        "ten": planned({"robot": "ur5", "waypoints": poses(ur5, WAYPOINTS)}),
        "panda": planned({"robot": "panda", "waypoints": poses(panda, WAYPOINTS)}),
        "joints": planned({"robot": "ur5", "waypoints": joints}),
        "paper_case": planned("paper_case"),
        "ur5_deburring": planned("ur5_deburring"),
        "panda_pick_place": planned("panda_pick_place"),
        "far": refused("ur5", poses(ur5, WAYPOINTS)),
        "far_panda": refused("panda", poses(panda, WAYPOINTS)),
        "long": planned({"robot": "panda", "waypoints": poses(panda, LONG)}),
        "all": solved(ur5),
        "all_search": solved(talos),
    }


def cost(task: Callable[[], object], runs: int) -> float:
    """Least time of the processor of some runs [s], after one that does not count."""
    task()
    least = np.inf
    for _ in range(runs):
        start = time.process_time()
        task()
        least = min(least, time.process_time() - start)
    return float(least)


def waypoints(n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, positions and velocities of random waypoints."""
    rng = np.random.default_rng(n)
    x = np.concatenate(([0.0], np.cumsum(rng.uniform(0.5, 1.5, n - 1))))
    return x, *rng.normal(size=(2, n, JOINTS))


def splines() -> dict[str, list[float]]:
    """Time to build a spline, and that of SciPy's CubicSpline, by number of waypoints [s]."""
    from scipy.interpolate import CubicSpline

    from knotwork import ModifiedHermiteSpline

    found = {}
    for n in SPLINES:
        x, y, v = waypoints(n)
        repeats = max(1, 10_000 // n)

        def ours(x: Any = x, y: Any = y, v: Any = v, repeats: int = repeats) -> None:
            for _ in range(repeats):
                ModifiedHermiteSpline(x, y, v)

        def theirs(x: Any = x, y: Any = y, repeats: int = repeats) -> None:
            for _ in range(repeats):
                CubicSpline(x, y)

        found[str(n)] = [cost(one, 3) / repeats for one in (ours, theirs)]
    return found


def evaluations() -> dict[str, list[float]]:
    """Time to evaluate a curve at sorted times, and that of SciPy's PPoly of it [s]."""
    from knotwork import ModifiedHermiteSpline

    found = {}
    for n, counts in SAMPLES.items():
        ours = ModifiedHermiteSpline(*waypoints(n))
        for count in counts:
            t, repeats = np.linspace(ours.x[0], ours.x[-1], count), max(1, 10_000 // count)

            def run(curve: Any, t: Any = t, repeats: int = repeats) -> None:
                for _ in range(repeats):
                    curve(t)

            both = (ours, ours.to_ppoly())
            found[f"{n}/{count}"] = [cost(partial(run, one), 3) / repeats for one in both]
    return found


def measured(plans: bool) -> None:
    """Measure one checkout, and print what was found."""
    found = {}
    for name, task in tasks().items() if plans else ():
        found[name] = cost(task, 1 if name == "long" else 5) / (20 if "all" in name else 1)
    print(json.dumps({"cases": found, "splines": splines(), "evaluations": evaluations()}))


def started(checkout: Path, arguments: list[str]) -> dict[str, float]:
    """How long a process of its own takes, by the clock and of the processor [s]."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    run(checkout, arguments)
    taken, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"by the clock": taken, "of the processor": spent}


def run(checkout: Path, arguments: list[str], **settings: str) -> str:
    """Run Python on a checkout, with settings of the environment, and give what it prints."""
    unlike_users = ("PYTHONDONTWRITEBYTECODE", "OPENBLAS_NUM_THREADS")
    kept = {k: v for k, v in os.environ.items() if k not in unlike_users}
    own = {"PYTHONPATH": str(checkout / "src"), **settings}
    line = [sys.executable, *arguments]
    done = subprocess.run(line, env={**kept, **own}, check=True, capture_output=True, text=True)
    return done.stdout


def compared(checkouts: dict[str, Path], rounds: int, plans: bool) -> dict[str, Any]:
    """Measure checkouts in turns; the least of all rounds of each [ms]."""
    arguments = [__file__, "--measure", *([] if plans else ["--without-plans"])]
    least: dict[tuple[str, str], float] = {}

    def keep(name: str, which: str, seconds: float) -> None:
        least[name, which] = min(least.get((name, which), np.inf), seconds)

    for _ in range(rounds):
        for which, checkout in checkouts.items():
            found = json.loads(run(checkout, arguments, OPENBLAS_NUM_THREADS="1"))
            for name, seconds in found["cases"].items():
                keep(name, which, seconds)
            for n, (ours, theirs) in {**found["splines"], **found["evaluations"]}.items():
                keep(n, which, ours)
                keep(n, "scipy", theirs)
            for _ in range(3):
                plan = started(checkout, ["-m", "knotwork", "plan", "ur5_deburring"])
                bare = started(checkout, ["-c", "import pinocchio"])
                for told in plan:
                    keep(told, which, plan[told])
                    keep(told, "pinocchio", bare[told])

    def row(name: str, *more: str) -> dict[str, float]:
        return {which: round(1e3 * least[name, which], 4) for which in (*checkouts, *more)}

    found = {"plans": [{"case": name, **row(name)} for name in CASES]} if plans else {}
    return {
        **found,
        "splines": [{"waypoints": n, **row(str(n), "scipy")} for n in SPLINES],
        "evaluations": [
            {"waypoints": n, "samples": count, **row(f"{n}/{count}", "scipy")}
            for n, counts in SAMPLES.items()
            for count in counts
        ],
        "starts": [
            {"told": told, **row(told, "pinocchio")}
            for told in ("by the clock", "of the processor")
        ],
    }


def tables(data: dict[str, Any]) -> list[Table]:
    """The tables of the page and the terminal."""
    plans = []
    for one in data["plans"]:
        said, aim = CASES[one["case"]]
        ratio = f"{one['after'] / one['before']:.2f}"
        times = [f"{one[which]:,.{2 if one[which] < 10 else 0}f}" for which in ("before", "after")]
        plans.append([said, *times, ratio, "" if aim is None else f"{aim:g}"])
    starts = []
    for one in data["starts"]:
        ratios = [one[which] / one["pinocchio"] for which in ("before", "after")]
        cells = [f"`knotwork plan ur5_deburring`, {one['told']}", *(f"{r:.2f}" for r in ratios)]
        starts.append([*cells, f"{ratios[1] / ratios[0]:.2f}", f"{MOST_STARTS}"])
    lines = []
    for one in data["splines"]:
        ratios = [one[which] / one["scipy"] for which in ("before", "after")]
        most = "1.0" if one["waypoints"] >= 1_000_000 else "2.0"
        cells = [f"{one['waypoints']:,}", *(f"{ratio:.2f}" for ratio in ratios)]
        lines.append([*cells, f"{ratios[1] / ratios[0]:.2f}", most])
    evaluated = []
    for one in data["evaluations"]:
        ratios = [one[which] / one["scipy"] for which in ("before", "after")]
        cells = [f"{one['waypoints']:,}", f"{one['samples']:,}", *(f"{r:.2f}" for r in ratios)]
        evaluated.append([*cells, f"{ratios[1] / ratios[0]:.2f}", "1.0"])
    columns = ("before", "after", "after / before", "aim")
    return [
        Table("Warm, in one process [ms]", ("", *columns), plans),
        Table("From a cold start, over a bare `import pinocchio`", ("", *columns), starts),
        Table(
            f"Building a spline of {JOINTS} joints, over SciPy's `CubicSpline`",
            ("waypoints", *columns),
            lines,
        ),
        Table(
            f"Evaluating a curve of {JOINTS} joints at sorted times, over SciPy's `PPoly` of it",
            ("waypoints", "times", *columns),
            evaluated,
        ),
    ]


@click.command()
@click.option("--before", type=click.Path(path_type=Path), help="Checkout to compare with.")
@click.option("--rounds", default=3, show_default=True)
@results.save_option
@click.option("--without-plans", is_flag=True, help="Measure cold starts and curves alone.")
@click.option("--measure", is_flag=True, hidden=True)
def main(
    before: Path | None, rounds: int, save: Path | None, without_plans: bool, measure: bool
) -> None:
    """Compare two checkouts in one run; what isn't measured stays as it was saved."""
    if measure:
        measured(not without_plans)
        return
    if before is None:
        raise click.UsageError("give --before, the folder of another checkout")
    known = results.load("speed") if without_plans else {}
    data = {
        **known,
        **compared({"before": before.resolve(), "after": ROOT}, rounds, not without_plans),
    }
    console = Console(width=130)
    for table in tables(data):
        table.show(console)
    if save is not None:
        results.save(save, "speed", {"rounds": rounds, **data})


if __name__ == "__main__":
    main()
