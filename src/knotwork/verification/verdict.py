"""The check: does a trajectory do what its scenario asks for?

It knows nothing of how the trajectory was made. From the trajectory and the scenario alone it
recomputes the tool's pose and velocity at each waypoint, the joint limits over all time, and
continuity.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from knotwork.joint_space import JointSpace, joint_space
from knotwork.polynomial import PiecewisePolynomial
from knotwork.scenario import Scenario
from knotwork.trajectory import JointTrajectory
from knotwork.verification.motion import QUANTITIES, continuity, limit_use, rate_unit
from knotwork.verification.report import Defect, LimitUse, Report, Requirement, Singularity
from knotwork.waypoints import CartesianWaypoint, FloatArray

# Torque and nearness to singularities are looked at this often, and at every break.
SAMPLES = 500
# Times that differ by rounding are the same.
TIME_ROUNDING = 1e-9


def check(
    trajectory: JointTrajectory,
    scenario: Scenario,
    *,
    space: JointSpace | None = None,
    defects: Sequence[str] = (),
) -> Report:
    """Check a trajectory against a scenario.

    Position, velocity, acceleration and jerk limits hold over all time: their extrema are exact.
    Effort is sampled by inverse dynamics, and marked so.

    Args:
        trajectory: The motion; its joints in any order.
        scenario: What is asked for.
        space: The scenario's joints and robot, if they have been loaded already.
        defects: Faults of the trajectory known beforehand, which the report is to count.

    Raises:
        InputError: The trajectory is not of the scenario's joints, or the scenario's robot can't
            be loaded.
    """
    space = space if space is not None else joint_space(scenario)
    curve = trajectory.reordered(space.joint_names, space.joint_units).polynomial
    requirements, missed = _requirements(trajectory, curve, scenario, space)
    limits: list[LimitUse] = list(limit_use(space, curve))
    singularity: Singularity | None = None
    if space.robot is not None:
        from knotwork.verification.tool import effort_use, smallest_singular_value

        regular = np.linspace(trajectory.start_time, trajectory.end_time, SAMPLES)
        time = np.sort(np.concatenate([regular, curve.x]))
        q, v, a = curve(time), curve(time, 1), curve(time, 2)
        limits += effort_use(space, space.robot, time, q, v, a)
        if space.robot.tool_frame is not None:
            singularity = smallest_singular_value(space.robot, time, q)
    return Report(
        scenario=scenario.name,
        robot=space.robot.name if space.robot is not None else None,
        planner=trajectory.planner,
        start_time=trajectory.start_time,
        end_time=trajectory.end_time,
        requirements=tuple(requirements),
        limits=tuple(limits),
        jumps=tuple(continuity(space, curve, scenario.continuity)),
        defects=tuple(Defect(message) for message in (*defects, *missed)),
        singularity=singularity,
    )


def _requirements(
    trajectory: JointTrajectory, curve: PiecewisePolynomial, scenario: Scenario, space: JointSpace
) -> tuple[list[Requirement], list[str]]:
    """Requirements at the waypoints, and what of the scenario's time the trajectory misses."""
    requirements: list[Requirement] = []
    missed: list[str] = []
    start, end = trajectory.start_time, trajectory.end_time
    slack = TIME_ROUNDING * max(1.0, abs(start), abs(end))
    for waypoint, state in zip(scenario.waypoints, space.targets, strict=True):
        if not start - slack <= waypoint.time <= end + slack:
            missed.append(
                f"waypoint {waypoint.name!r} is at {waypoint.time:.9g} s, but the trajectory lasts "
                f"from {start:.9g} s to {end:.9g} s"
            )
            continue
        time = min(max(waypoint.time, start), end)
        q, v = curve(time), curve(time, 1)
        if state is not None:
            for order, asked, found in ((0, state.position, q), (1, state.velocity, v)):
                requirements.append(
                    _joint_requirement(
                        waypoint.name, waypoint.time, order, asked, found, space, scenario
                    )
                )
        elif isinstance(waypoint, CartesianWaypoint) and space.robot is not None:
            from knotwork.verification.tool import tool_requirements

            requirements += tool_requirements(waypoint, space.robot, q, v, scenario.tolerances)
    first, last = scenario.waypoints[0], scenario.waypoints[-1]
    if start < first.time - slack or end > last.time + slack:
        missed.append(
            f"the trajectory lasts from {start:.9g} s to {end:.9g} s, longer than the scenario, "
            f"whose waypoints are from {first.time:.9g} s to {last.time:.9g} s"
        )
    requirements += _end_requirements(curve, scenario, space)
    return requirements, missed


def _end_requirements(
    curve: PiecewisePolynomial, scenario: Scenario, space: JointSpace
) -> Iterator[Requirement]:
    """The accelerations at the two ends, where the scenario asks for them."""
    asked = space.end_acceleration
    if asked is None:
        return
    ends = (scenario.waypoints[0], scenario.waypoints[-1])
    for waypoint, time, requested in zip(ends, (curve.x[0], curve.x[-1]), asked, strict=True):
        yield _joint_requirement(
            waypoint.name, float(time), 2, requested, curve(time, 2), space, scenario
        )


def _joint_requirement(
    name: str,
    time: float,
    order: int,
    requested: FloatArray,
    achieved: FloatArray,
    space: JointSpace,
    scenario: Scenario,
) -> Requirement:
    """Compare joint values, and show the joint that is furthest off for its tolerance."""
    quantity = f"joint_{QUANTITIES[order]}"
    by_unit = getattr(scenario.tolerances, quantity)
    tolerances = np.array([by_unit[unit] for unit in space.joint_units])
    errors = np.abs(achieved - requested)
    worst = int((errors / tolerances).argmax())
    return Requirement(
        name,
        time,
        quantity,
        tuple(requested.tolist()),
        tuple(achieved.tolist()),
        float(errors[worst]),
        float(tolerances[worst]),
        rate_unit(space.joint_units[worst], order),
        bool(errors[worst] <= tolerances[worst]),
    )
