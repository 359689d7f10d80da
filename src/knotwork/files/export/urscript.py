"""URScript: a program that runs a motion on a controller of Universal Robots.

The program computes the cubic of each piece from the positions and velocities at its ends, like
Universal Robots' own driver. In each step it sends the controller one `speedj` with the velocity at
the end of the step, and with the acceleration that reaches this velocity in the step. Thus the
commanded velocity equals that of the motion at every step and is linear between steps. Its integral
has the error of the trapezoidal rule, h² (a(t) - a(0)) / 12 for steps of h [s] and a continuous
acceleration a(t).

Outputs are switched and payloads set between two pieces, up to a step before their time.

The clock continues over knots, which may be between two steps. The error of the controller's target
is corrected with a time constant of 1/`TARGET_GAIN`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import Event, JointTrajectory, Load
from knotwork.errors import ExportError
from knotwork.files.export.labels import one_ascii_line, unsupported_event
from knotwork.files.export.lossless import MotionPoints, motion_points
from knotwork.files.export.pvt import increments
from knotwork.files.export.straight import bound_text, require_rest_at_ends

if TYPE_CHECKING:
    from knotwork.robot import Robot

UR_JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
"""Joints of the arms, base first, in the controller's order; a common prefix is allowed."""

START_DISTANCE = 0.001
"""Largest distance of the arm from the first point at the start, in each joint [rad]."""

UR_OUTPUTS = (
    *(("standard", i) for i in range(8)),
    *(("configurable", i) for i in range(8)),
    *(("tool", i) for i in range(2)),
)
"""Digital outputs, numbered consecutively, like the controller's bits."""

FLANGE = "tool0"
"""The link with the axes of the controller's flange; a prefix is allowed."""

MIN_PIECE_DURATION = 1e-4
"""Minimum duration of a piece [s]; an event nearer to a knot is at the knot.

The program extrapolates a piece by up to a step, and rounding grows by the cube of the ratio of
step and duration.
"""

MAX_TRACKING_ERROR = 0.05
"""Error of the target of a joint beyond which the program stops the arm [rad].

At 125 Hz a joint at 3 rad/s moves by half of it in a step.
"""

RATES = (125, 500)
"""Control rates of the CB series and the e-Series [Hz]."""

TARGET_GAIN = 2.0
"""Gain of the correction of a target's error [1/s]."""

_PROGRAM = Path(__file__).with_name("urscript_program.script")
"""The program in URScript, with its values in braces."""


def to_urscript(
    motion: JointTrajectory | MotionPoints,
    *,
    tolerance: float | None = None,
    robot: Robot | None = None,
) -> str:
    """Write a program in URScript that runs a motion of an arm of Universal Robots.

    It runs on controllers with arithmetic of lists: PolyScope 3.14.3, 5.9.4 and later, PolyScope X.
    The arm must start at the first point. At the end it is at rest at the last point.

    >>> import knotwork as kw
    >>> text = to_urscript(kw.plan("ur5_deburring").trajectory)
    >>> text.count("  kw_cubic("), text.count("def knotwork_motion():")
    (17, 1)

    Args:
        motion: The motion, or points of it from `motion_points`. Positions in rad, times
            in s; every number is written with all its digits.
        tolerance: Insert points until the error is within this tolerance [rad]; by default the
            knots must define it exactly.
        robot: The arm with its tool, whose centre point the program sets.

    Raises:
        ExportError: The points can't define the motion, see `motion_points`; the joints are not
            those of such an arm; it does not start and end at rest; or a signal is not an output.
        InputError: The tolerance is out of range.
    """
    points = motion_points(motion, tolerance=tolerance)
    trajectory = points.trajectory
    order = _joint_order(trajectory)
    require_rest_at_ends(trajectory)
    time = _with_events(trajectory)
    position, velocity = (trajectory(time, nu)[:, order] for nu in range(2))
    velocity[[0, -1]] = 0.0
    durations = increments(np.asarray(time - time[0]))
    between = _lines_before_pieces(trajectory, time)
    pieces = [*_tool(robot), *between[0]]
    for i in range(1, len(durations)):
        ends = f"{_numbers(position[i])}, {_numbers(velocity[i])}, {_number(durations[i])}"
        pieces += [f"kw_cubic({ends})", *between[i]]
    about = [
        f"A motion of {trajectory.duration:.6g} s for an arm of Universal Robots.",
        f"{points.describe()}.",
        "Each line kw_cubic is a piece: positions [rad] and velocities [rad/s] at its end, and its",
        "duration [s]. The arm must stand at the first point. Try it in the simulator first.",
        f"{describe_steps(trajectory)}.",
        f"Joints: {', '.join(one_ascii_line(trajectory.joint_names[i]) for i in order)}.",
    ]
    program = _PROGRAM.read_text(encoding="utf-8").format(
        first=_numbers(position[0]),
        rest=_numbers(np.zeros(len(UR_JOINTS))),
        largest=_number(MAX_TRACKING_ERROR),
        gain=_number(TARGET_GAIN),
        start=_number(START_DISTANCE),
        pieces="\n".join(f"  {line}" for line in pieces),
    )
    return "".join(f"# {line}\n" for line in about) + program


def describe_steps(motion: JointTrajectory) -> str:
    """Describe the trapezoidal error of the controller's steps, which feedback may double."""
    bounds = motion.extrema("acceleration")
    first = motion.acceleration(motion.start_time)
    change = float(np.maximum(bounds.maximum - first, first - bounds.minimum).max())
    off = (f"{bound_text(change / (6.0 * rate**2), 2)} rad at {rate} Hz" for rate in RATES)
    return f"steps of speedj are off the motion by at most {' and '.join(off)}"


def _with_events(trajectory: JointTrajectory) -> FloatArray:
    """Times of the knots, and of events and loads between them [s]: a cubic may be divided."""
    time: FloatArray = trajectory.knots.time
    events = [item.time for item in trajectory.events]
    for moment in (*events, *(item.time for item in trajectory.loads)):
        if np.abs(time - moment).min() > MIN_PIECE_DURATION:
            time = np.sort(np.append(time, moment))
    return time


def _lines_before_pieces(trajectory: JointTrajectory, time: FloatArray) -> list[list[str]]:
    """Lines before the piece that starts at each time: settings, and the name of a new segment."""
    lines: list[list[str]] = [[] for _ in time]
    for event in trajectory.events:
        lines[int(np.abs(time - event.time).argmin())].append(_switch(event))
    for load in trajectory.loads:
        lines[int(np.abs(time - load.time).argmin())].append(_load(load))
    for segment in trajectory.segments:
        i = int(np.searchsorted(time, segment.start, "right")) - 1
        lines[max(i, 0)].append(f"# {one_ascii_line(segment.text)}")
    return lines


def _load(load: Load) -> str:
    """The command that sets the payload, which is only possible in the axes of the flange."""
    if not load.frame.endswith(FLANGE):
        return f"# payload of {load.mass:.6g} kg at {one_ascii_line(load.frame)}, not set"
    mass, centre = _number(load.mass), _numbers(np.array(load.centre_of_mass))
    if any(load.inertia):
        inertia = _numbers(np.array(load.inertia))
        return (
            f"set_target_payload({mass}, {centre}, {inertia})  # kg, m, kg m^2, {load.time:.3f} s"
        )
    return f"set_payload({mass}, {centre})  # kg, m, {load.time:.3f} s"


def _tool(robot: Robot | None) -> list[str]:
    """The command that sets the tool centre point, if its pose at the flange is known."""
    import pinocchio as pin

    if robot is None:
        return ["# The tool centre point is not set: no robot is given."]
    if not (robot.tool_frame or "").endswith(FLANGE):
        return [f"# tool centre point at {one_ascii_line(robot.tool_frame or '')}, not set"]
    offset = robot.tool_offset
    pose = np.append(offset.translation, pin.log3(offset.rotation))
    return [f"set_tcp(p{_numbers(pose)})  # m, rotation vector in rad"]


def _switch(event: Event) -> str:
    """The command that switches an output, with a comment on it."""
    n = event.output
    if n is None or n >= len(UR_OUTPUTS):
        numbers = "0 to 7 (standard), 8 to 15 (configurable), 16 or 17 (at the tool)"
        accepted = (
            f"the number of a digital output, {numbers}, given by outputs: {{{event.name}: n}}"
        )
        raise unsupported_event(event, "Universal Robots", accepted)
    kind, number = UR_OUTPUTS[n]
    text, waypoint = one_ascii_line(event.text), one_ascii_line(event.waypoint)
    words = f"{text}, {event.time:.3f} s, waypoint {waypoint}"
    return f"set_{kind}_digital_out({number}, {bool(event.value)})  # {words}"


def _number(value: float) -> str:
    """The shortest decimals that give a number back exactly, without a power of ten."""
    return np.format_float_positional(value, unique=True, trim="0")


def _numbers(values: FloatArray) -> str:
    return f"[{', '.join(_number(value) for value in values.tolist())}]"


def _joint_order(trajectory: JointTrajectory) -> list[int]:
    """Index of each of `UR_JOINTS` among the joints of a motion."""
    names = list(trajectory.joint_names)
    first = next((joint for joint in UR_JOINTS if names[0].endswith(joint)), "")
    prefix = names[0].removesuffix(first)
    wanted = [prefix + name for name in UR_JOINTS]
    if sorted(names) != sorted(wanted):
        raise ExportError(
            f"the motion moves {', '.join(names)}; a controller of Universal Robots moves six "
            f"joints, which must be named {', '.join(UR_JOINTS)}, in any order, all with the same "
            "prefix if any"
        )
    for name, unit in zip(names, trajectory.joint_units, strict=True):
        if unit != "rad":
            raise ExportError(f"joint {name!r} is in {unit}; it must be in rad", joint=name)
    return [names.index(name) for name in wanted]
