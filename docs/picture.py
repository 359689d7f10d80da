"""Draw the README's picture: the joints of `ur5_deburring`, and its tool speed, over time."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")

import matplotlib.pyplot as plt

import knotwork as kw

# Okabe and Ito's colours, which colour-blind readers can tell apart.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
OUTPUT = Path(__file__).parent / "ur5_deburring.png"


def main() -> None:
    """Plan the scenario, and draw velocity, acceleration and tool speed."""
    plan = kw.plan("ur5_deburring")
    plan.report.raise_if_failed()
    trajectory, robot = plan.trajectory, plan.space.robot
    if robot is None:
        raise TypeError("the scenario has lost its robot")
    time = np.linspace(trajectory.start_time, trajectory.end_time, 2001)
    q, v = trajectory.position(time), trajectory.velocity(time)
    tool = [np.linalg.norm(robot.twist(*state).linear) for state in zip(q, v, strict=True)]

    figure, axes = plt.subplots(3, 1, figsize=(9, 7.2), sharex=True, layout="constrained")
    rows = ((1, "joint velocity [rad/s]"), (2, "joint acceleration [rad/s²]"))
    waypoints, knots = plan.joint_waypoints.time, trajectory.breaks
    for axis, (order, label) in zip(axes, rows, strict=False):
        values = trajectory(time, order)
        for joint, (name, colour) in enumerate(zip(trajectory.joint_names, COLOURS, strict=True)):
            axis.plot(time, values[:, joint], color=colour, label=name.removesuffix("_joint"))
            axis.plot(waypoints, trajectory(waypoints, order)[:, joint], "o", color=colour, ms=4)
        axis.set_ylabel(label)
    axes[0].legend(ncols=3, fontsize=9, frameon=False, loc="upper right")
    axes[2].plot(time, 1e3 * np.array(tool), color="black")
    asked = [
        (waypoint.time, 1e3 * float(np.linalg.norm(waypoint.linear)))
        for waypoint in plan.scenario.waypoints
        if isinstance(waypoint, kw.CartesianWaypoint)
    ]
    axes[2].plot(
        *zip(*asked, strict=True), "o", color="black", ms=5, label="asked for at waypoints"
    )
    axes[2].legend(fontsize=9, frameon=False, loc="upper right")
    axes[2].set(ylabel="tool speed [mm/s]", xlabel="time [s]")
    for axis in axes:
        axis.vlines(knots, 0, 0.04, transform=axis.get_xaxis_transform(), color="0.4", lw=1)
        axis.axvspan(5, 11, color="0.93", zorder=0)
        axis.margins(x=0.01)
        axis.spines[["top", "right"]].set_visible(False)
    axes[0].set_title(
        "UR5 deburring an edge: dots are waypoints, ticks below the rebuilt knots, grey the edge",
        fontsize=10,
    )
    figure.savefig(OUTPUT, dpi=120)


if __name__ == "__main__":
    main()
