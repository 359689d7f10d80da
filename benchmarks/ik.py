"""Inverse kinematics: how often it succeeds, how complete it is, how fast beside other solvers.

    python benchmarks/ik.py success   # 1,000 reachable poses for each arm, and poses at the edge
    python benchmarks/ik.py branches  # all solutions against closed forms
    python benchmarks/ik.py speed     # one solution, beside whatever else is installed

Run it on one thread (OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1). The other solvers are no
dependencies; for `speed` put them into an environment of their own beside Knotwork:

    python -m venv peers
    peers/bin/pip install . pin-pink quadprog mink daqp drake
    peers/bin/pip install pytracik roboticstoolbox-python EAIK ssik

Those that are not there are shown as such; placo 0.10 needs an older Pinocchio and stays out.
Every answer, whoever's it is, goes through the same check: Pinocchio's forward kinematics within
1e-8 m and 1e-8 rad (a second figure counts 1e-4), and joint limits. Solvers take turns pose by
pose, so that a noisy machine disturbs all alike.
"""

from __future__ import annotations

import click
from rich.console import Console
from rich.table import Table

from ik_branches import branches
from ik_speed import speed
from ik_success import singular, success


@click.command()
@click.argument("what", type=click.Choice(["success", "branches", "speed"]))
@click.option("--poses", default=1000, show_default=True)
@click.option("--markdown", is_flag=True, help="Print Markdown tables.")
def main(what: str, poses: int, markdown: bool) -> None:
    """Measure inverse kinematics and print a table."""
    if what == "success":
        tables = [success(poses), singular(max(1, poses // 10))]
    else:
        tables = [branches(poses) if what == "branches" else speed(poses)]
    console = Console(width=120)
    for table in tables:
        if markdown:
            print(in_markdown(table))
        else:
            console.print(table)


def in_markdown(table: Table) -> str:
    """Write a table in Markdown."""
    names = [str(column.header) for column in table.columns]
    rows = zip(*(column.cells for column in table.columns), strict=True)
    lines = [f"**{table.title}**", "", f"| {' | '.join(names)} |", "|---" * len(names) + "|"]
    lines += [f"| {' | '.join(str(cell) for cell in row)} |" for row in rows]
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    main()
