"""Inverse kinematics: how often it succeeds, how complete it is, how fast beside other solvers.

    python benchmarks/ik.py success   # 1,000 reachable poses for each arm, and poses at the edge
    python benchmarks/ik.py branches  # all solutions against closed forms
    python benchmarks/ik.py speed     # one solution, beside whatever else is installed

With `--save benchmarks/results` the results are saved there, and the site shows them.

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

from pathlib import Path

import click
from rich.console import Console

import ik_tables
import results
from ik_branches import branches
from ik_speed import speed
from ik_success import success

MEASURE = {"success": success, "branches": branches, "speed": speed}


@click.command()
@click.argument("what", type=click.Choice(list(MEASURE)))
@click.option("--poses", default=1000, show_default=True)
@results.save_option
def main(what: str, poses: int, save: Path | None) -> None:
    """Measure inverse kinematics and print a table."""
    data = MEASURE[what](poses)
    for table in ik_tables.tables(f"ik_{what}", data):
        table.show(Console(width=120))
    if save is not None:
        print(results.save(save, f"ik_{what}", data))


if __name__ == "__main__":
    main()
