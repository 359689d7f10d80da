"""Tables of what the benchmarks of inverse kinematics measured."""

from __future__ import annotations

from typing import Any

from results import Table

Data = dict[str, Any]


def tables(name: str, data: Data) -> list[Table]:
    """Tables of `ik_success`, `ik_branches` or `ik_speed`."""
    return {
        "ik_success": lambda: [success(data), singular(data)],
        "ik_branches": lambda: [branches(data)],
        "ik_speed": lambda: [speed(data)],
    }[name]()


def success(data: Data) -> Table:
    """Solved poses of each arm."""
    rows = []
    for row in data["arms"]:
        counts = [f"{row[key]}/{row['poses']}" for key in ("from_anywhere", "from_near")]
        near = f"{row['kept_near']}/{row['from_near']}"
        rows.append([row["arm"], *counts, near, f"{row['at_limits']}/{row['poses_at_limits']}"])
    return Table(
        f"Solved of {data['poses']} reachable poses, and at the edge",
        ("arm", "from anywhere", "from 0.1 rad", "of these kept near", "at limits"),
        rows,
    )


def singular(data: Data) -> Table:
    """Solved poses at singularities, and those a micrometre out of reach."""
    rows = [
        [row["arm"], row["where"], f"{row['solved']}/{row['poses']}"] for row in data["singular"]
    ]
    beyond = data["beyond"]
    refused = f"refused {beyond['refused']}/{beyond['poses']}"
    rows.append([beyond["arm"], "1 µm beyond full stretch", refused])
    return Table("At singularities, from anywhere", ("arm", "where", "solved"), rows, labels=2)


def branches(data: Data) -> Table:
    """All solutions against closed forms."""
    rows = []
    for row in data["rows"]:
        bent = row["from_straight"]
        rows.append(
            [
                row["arm"],
                "anywhere" if bent is None else f"{bent:.0e} rad from straight",
                str(row["closed_form"]),
                str(row["found"]),
                f"{row['found'] / row['closed_form']:.3%}",
                str(row["beside"]),
                f"{row['ms']:.1f}",
            ]
        )
    return Table(
        f"Branches found, {data['poses']} poses",
        ("arm", "wrist", "closed form", "found", "share", "beside these", "ms a pose"),
        rows,
        labels=2,
    )


def speed(data: Data) -> Table:
    """Time of one solution, beside other solvers."""
    rows = []
    for row in data["rows"]:
        cells = [row["arm"], row["start"], row["solver"]]
        if "refused" in row:
            rows.append([*cells, row["refused"].partition(". ")[0]])
            continue
        alone = row["median_us"] is not None  # in a batch no pose has a time of its own
        cells += [f"{row['mean_us']:.{0 if alone else 1}f}", f"{row['to_tuned']:.2f}"]
        cells += [f"{row[key]:.0f}" if alone else "-" for key in ("median_us", "p99_us")]
        rows.append([*cells, f"{row['percent_1e-8']:.1f}%", f"{row['percent_1e-4']:.1f}%"])
    return Table(
        f"One solution, {data['poses']} poses, one thread [µs]",
        ("arm", "start", "solver", "mean", "/ tuned", "median", "p99", "to 1e-8", "to 1e-4"),
        rows,
        labels=3,
    )


class Figures:
    """Figures that sentences quote from the table of times."""

    def __init__(self, data: Data) -> None:
        self.rows = [row for row in data["rows"] if "refused" not in row]

    def _of(self, solvers: tuple[str, ...], start: str, key: str) -> list[float]:
        return [row[key] for row in self.rows if row["solver"] in solvers and row["start"] == start]

    def ratio(self, start: str, *solvers: str) -> str:
        """Range over arms and solvers of the time relative to the tuned loop."""
        values = self._of(solvers, start, "to_tuned")
        digits = 1 if max(values) >= 5 else 2
        least, most = (f"{value:.{digits}f}" for value in (min(values), max(values)))
        return least if least == most else f"{least} to {most}"

    def share(self, start: str, *solvers: str) -> str:
        """Range of the poses solved within 1e-8 [%]."""
        values = self._of(solvers, start, "percent_1e-8")
        least, most = (f"{value:.0f}" for value in (min(values), max(values)))
        return least if least == most else f"{least} to {most}"
