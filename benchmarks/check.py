"""What a proof costs: the check of a scenario, proved over all time and sampled.

The sampled check looks at torque, singular values and tool speed at 500 times, as a check without
proofs would; all else is the same. Both run in turn in one process, so that a noisy machine
disturbs both alike. The ratio is what to look at.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import click
import numpy as np
from rich.console import Console

import knotwork as kw
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.verification import CHECKS, Finding, Motion
from results import Table

SAMPLES = 500


def sampled(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Iterator[Finding]:
    """Torque, singular values and, if it is limited, tool speed at some times; finds nothing."""
    robot = joints.robot
    if robot is None:
        return
    times = np.linspace(motion.start_time, motion.end_time, SAMPLES)
    torque, speed, nearest = np.zeros(robot.dof), 0.0, np.inf
    for q, v, a in zip(*(motion.curve(times, nu) for nu in range(3)), strict=True):
        torque = np.maximum(torque, np.abs(robot.effort(q, v, a)))
        if scenario.motion_limits.tool_speed is not None:
            speed = max(speed, float(np.linalg.norm(robot.twist(q, v).linear)))
        nearest = min(nearest, float(np.linalg.svd(robot.jacobian(q), compute_uv=False)[-1]))
    yield from ()


PROOFS = ("effort_limits", "tool_limits", "singularity")


def cost(action: Callable[[], object]) -> float:
    """Time of the processor [s]."""
    start = time.process_time()
    action()
    return time.process_time() - start


@click.command()
@click.argument("scenarios", nargs=-1)
@click.option("--runs", default=15, help="Times each check is made; the fastest counts.")
def main(scenarios: tuple[str, ...], runs: int) -> None:
    """Compare the proved check with the sampled one."""
    rows = []
    for name in scenarios or ("ur5_deburring", "panda_pick_place", "ur10_spray"):
        plan = kw.plan(name)
        proved = dict(CHECKS)
        least: dict[str, float] = {}
        for _ in range(runs):
            for kind in ("proved", "sampled"):
                CHECKS.clear()
                CHECKS.update(proved)
                if kind == "sampled":
                    for key in PROOFS:
                        del CHECKS[key]
                    CHECKS["sampled"] = sampled
                # a new trajectory: extrema are kept with the curve
                curve = kw.PiecewisePolynomial(plan.trajectory.polynomial.c, plan.trajectory.breaks)
                motion = kw.JointTrajectory(
                    plan.trajectory.joint_names, curve, joint_units=plan.trajectory.joint_units
                )

                def act(motion: kw.JointTrajectory = motion, plan: kw.Plan = plan) -> kw.Report:
                    return kw.check(motion, plan.scenario, joints=plan.joints)

                least[kind] = min(least.get(kind, np.inf), cost(act))
        CHECKS.clear()
        CHECKS.update(proved)
        ratio = least["proved"] / least["sampled"]
        milliseconds = [f"{1e3 * least[kind]:.1f}" for kind in ("proved", "sampled")]
        rows.append([name, *milliseconds, f"{ratio:.2f}"])
    columns = ("scenario", "proved [ms]", "sampled [ms]", "ratio")
    Table("The whole check", columns, rows, f"least of {runs}, CPU time").show(Console())


if __name__ == "__main__":
    main()
