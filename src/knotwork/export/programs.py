"""Programs of points for controllers of KUKA, ABB and FANUC.

Such a controller plans its own motion between the points of a program, from positions and times,
without velocities. The points are so close that straight lines between them are within a tolerance
of the motion, and the program states the error. The rounding of corners by a controller
is not published.

At rests of the arm the program waits. Outputs are switched at separate points, by the
controller's function for switching in motion: TRIGGER, TriggAbsJ, TB.

Angles are those of the URDF, in deg, and lengths in mm. URDFs of ROS-Industrial count axes as the
controllers do. FANUC counts J3 from the horizontal.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knotwork.errors import ExportError
from knotwork.errors.plain_text import waypoint_text
from knotwork.export.straight import (
    ARM_AXES,
    AXES_ACCEPTED,
    RESTING_SPEED,
    STRAIGHT,
    TIME_TICK,
    Positions,
    arm_joints,
    bound_text,
    from_horizontal,
    straight_points,
)
from knotwork.spline.trajectory import Event, JointTrajectory
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from knotwork.robot import Robot

REMARK_LENGTH = 32
"""Number of characters of a remark of FANUC."""
MOST_TRIGGERS = 8
"""Largest number of triggers of one move of ABB."""


@dataclass(frozen=True)
class ProgramStep:
    """The step from one point to the next.

    Attributes:
        to: Index of the point.
        time: Duration [s].
        stands: Whether the arm is at rest.
        first, last: Whether the arm starts to move, or comes to rest at the end.
        notes: Names of segments that begin at its start.
        switched: Events at its end.
    """

    to: int
    time: float
    stands: bool
    first: bool
    last: bool
    notes: tuple[str, ...]
    switched: tuple[Event, ...]


def to_krl(
    motion: JointTrajectory | Positions, *, fit: float | None = None, robot: Robot | None = None
) -> str:
    """Write a program for a controller of KUKA: spline blocks of axis positions, with times.

    The controller draws a spline through the points (KSS 8.3 and later). Its algorithm is not
    published; the points are close enough for straight lines.

    >>> import knotwork as kw
    >>> to_krl(kw.plan("ur5_deburring").trajectory).count("SPTP {")
    69

    Args:
        motion: From rest to rest, of an arm with six revolute axes, base first; sliding joints are
            external axes. Or points of it from `knotwork.export.straight_points`.
        fit: Largest error of straight lines between points [rad or m]; by default
            1e-3.
        robot: Robot with the revolute external axes, those of tables and positioners.

    Raises:
        ExportError: The motion moves at an end, the arm has other axes, or an event has no
            output.
        InputError: The tolerance is out of range.
    """
    points = straight_points(motion, **STRAIGHT["krl"], fit=fit)
    arm, outer, further = _axes(points, points.position, robot)
    names = [f"A{j + 1}" for j in range(ARM_AXES)] + [f"E{j + 1}" for j in range(outer.shape[1])]

    def axes(i: int) -> str:
        values = zip(names, (*arm[i], *outer[i]), strict=True)
        return "{" + ", ".join(f"{name} {value:.6f}" for name, value in values) + "}"

    def switch(event: Event) -> str:
        return f"$OUT[{_number(event, 'KUKA')}]={'TRUE' if event.value else 'FALSE'}"

    lines = ["DEF knotwork_motion()"]
    lines += [
        f"  ; {line}" for line in (*_about(points, "KUKA", further), "File: knotwork_motion.src.")
    ]
    lines += ["  BAS(#INITMOV, 0)", f"  PTP {axes(0)}"]
    lines += [f"  {switch(event)}" for event in _at_start(points)]
    began = 0.0
    for step in _steps(points):
        lines += [f"  ; {note}" for note in step.notes]
        if step.stands:
            lines += [f"  WAIT SEC {step.time:.3f}", *(f"  {switch(e)}" for e in step.switched)]
            continue
        if step.first:
            began = points.time[step.to - 1]
            lines += ["  PTP_SPLINE", "    TIME_BLOCK START"]
        if not step.last:
            done = [f"    TRIGGER WHEN PATH=0 DELAY=0 DO {switch(e)}" for e in step.switched]
            lines += done
        # parts are proportions of the time at the end of the block
        lines += [f"    SPTP {axes(step.to)}", f"    TIME_BLOCK PART = {step.time:.3f}"]
        if step.last:
            lines += [f"    TIME_BLOCK END = {points.time[step.to] - began:.3f}", "  ENDSPLINE"]
            lines += [f"  {switch(event)}" for event in step.switched]
    return _text([*lines, "END"])


def to_rapid(
    motion: JointTrajectory | Positions, *, fit: float | None = None, robot: Robot | None = None
) -> str:
    """Write a module for a controller of ABB: moves between axis positions, with times.

    Arguments and errors are those of `to_krl`. A signal keeps its name, or is `do3` for output 3
    without a name.

    >>> import knotwork as kw
    >>> to_rapid(kw.plan("ur5_deburring").trajectory).count("MoveAbsJ kw_q")
    70
    """
    points = straight_points(motion, **STRAIGHT["rapid"], fit=fit)
    arm, outer, further = _axes(points, points.position, robot)
    lines = ["MODULE KnotworkMotion", *(f"  ! {line}" for line in _about(points, "ABB", further))]
    lines += [f"  CONST jointtarget kw_q{{{points.time.size}}} := ["]
    for i in range(points.time.size):
        more = [f"{value:.6f}" for value in outer[i]] + ["9E9"] * (ARM_AXES - outer.shape[1])
        angles = ",".join(f"{value:.6f}" for value in arm[i])
        lines += [f"    [[{angles}],[{','.join(more)}]]{',' * (i + 1 < points.time.size)}"]
    steps = list(_steps(points))
    lines += ["  ];"]
    flying = {
        id(event): f"kw_t{n}"
        for n, event in enumerate(
            (e for s in steps if not (s.stands or s.last) for e in s.switched), 1
        )
    }
    lines += [f"  VAR triggdata {name};" for name in flying.values()]
    lines += ["  PROC knotwork_motion()"]
    lines += [
        rf"    TriggIO {flying[id(e)]}, 0\Time\DOp:={_signal(e)}, {int(bool(e.value))};"
        for step in steps
        for e in step.switched
        if id(e) in flying
    ]
    lines += [r"    MoveAbsJ kw_q{1}\NoEOffs, v100, fine, tool0;"]
    lines += [_set_output(event) for event in _at_start(points)]
    for step in steps:
        lines += [f"    ! {note}" for note in step.notes]
        if step.stands:
            lines += [rf"    WaitTime\InPos, {step.time:.3f};", *map(_set_output, step.switched)]
            continue
        triggers = [flying[id(event)] for event in step.switched if id(event) in flying]
        if len(triggers) > MOST_TRIGGERS:
            raise ExportError(f"ABB switches {MOST_TRIGGERS} signals at a time at most")
        further_triggers = "".join(rf"\T{n}:={name}" for n, name in enumerate(triggers[1:], 2))
        name, middle = (
            ("TriggAbsJ", f"{triggers[0]}{further_triggers}, ") if triggers else ("MoveAbsJ", "")
        )
        zone = "fine" if step.last else "z0"
        move = rf"{name} kw_q{{{step.to + 1}}}\NoEOffs, v5000\T:={step.time:.3f}, {middle}{zone}"
        lines += [f"    {move}, tool0;"]
        if step.last:
            lines += map(_set_output, step.switched)
    return _text([*lines, "  ENDPROC", "ENDMODULE"])


def to_ls(
    motion: JointTrajectory | Positions, *, fit: float | None = None, robot: Robot | None = None
) -> str:
    """Write a program for a controller of FANUC: joint moves with times.

    Arguments and errors are those of `to_krl`. The angle J3 counts from the horizontal: it is
    joint 3 less joint 2 of a URDF of ROS-Industrial.

    >>> import knotwork as kw
    >>> to_ls(kw.plan("ur5_deburring").trajectory).count("msec CNT100")
    68
    """
    points = straight_points(motion, **STRAIGHT["ls"], fit=fit)
    arm, outer, further = _axes(points, from_horizontal(points, robot), robot)

    def switch(event: Event) -> str:
        return f"DO[{_number(event, 'FANUC')}]={'ON' if event.value else 'OFF'}"

    off = f"lines {bound_text(points.error, 2)} off"
    moves = [f"  !{points.time[-1]:.3f} s, {off}"[: REMARK_LENGTH + 3], "J P[1] 10% FINE"]
    moves += [f"  {switch(event)}" for event in _at_start(points)]
    for step in _steps(points):
        # remarks have up to 32 characters
        moves += [f"  !{note[:REMARK_LENGTH]}" for note in step.notes]
        switched = [switch(event) for event in step.switched]
        if step.stands:
            moves += [f"  WAIT {step.time:.2f}(sec)"]
        else:
            end = "FINE" if step.last else "CNT100"
            on_the_way = f" TB .00sec,{switched.pop(0)}" if switched and not step.last else ""
            moves += [f"J P[{step.to + 1}] {round(step.time / TIME_TICK)}msec {end}{on_the_way}"]
        moves += [f"  {line}" for line in switched]
    lines = ["/PROG  KNOTWORK", "/ATTR", 'COMMENT = "KNOTWORK";', "DEFAULT_GROUP = 1,*,*,*,*;"]
    lines += ["/MN", *(f"{i:4}:{move} ;" for i, move in enumerate(moves, 1)), "/POS"]
    for i in range(points.time.size):
        values = [f"J{j + 1} = {value:.4f} deg" for j, value in enumerate(arm[i])]
        external = enumerate(zip(outer[i], further.values(), strict=True), 1)
        values += [f"E{j} = {value:.4f} {unit}" for j, (value, unit) in external]
        lines += [f"P[{i + 1}]{{", "   GP1:", "  UF : F, UT : F,", f"  {', '.join(values)}", "};"]
    return _text([*lines, "/END"])


def _axes(
    points: Positions, q: FloatArray, robot: Robot | None
) -> tuple[FloatArray, FloatArray, dict[str, str]]:
    """Angles of the arm [deg], shape (n, 6), external axes, and their units: deg or mm."""
    units = points.trajectory.joint_units
    arm = arm_joints(points.trajectory, robot)
    outer = [i for i in range(len(units)) if i not in arm]
    if len(arm) != ARM_AXES or len(outer) > ARM_AXES:
        raise ExportError(f"the motion has {len(outer)} other and {len(arm)} {AXES_ACCEPTED}")
    factors = np.array([180.0 / np.pi if units[i] == "rad" else 1e3 for i in outer])
    names = points.trajectory.joint_names
    shown = {names[i]: "deg" if units[i] == "rad" else "mm" for i in outer}
    return np.degrees(q[:, arm]), q[:, outer] * factors, shown


def _steps(points: Positions) -> Iterator[ProgramStep]:
    """The steps between the points, with the events at their ends."""
    motion, time = points.trajectory, points.time
    switched: list[list[Event]] = [[] for _ in time]
    for event, i in _events_by_point(points):
        switched[i].append(event)
    notes: list[list[str]] = [[] for _ in time]
    for segment in motion.segments:
        start = segment.start - motion.start_time + 0.5 * TIME_TICK
        i = int(np.searchsorted(time, start, "right"))
        notes[min(i, len(time) - 1)].append(_ascii(segment.name))
    stands = [False, *_stands(points), False]
    waited = 0.0
    for i in range(1, len(time)):
        step = float(time[i] - time[i - 1]) + waited
        on = i + 1 < len(time) and not (switched[i] or notes[i + 1])
        waited = step if stands[i] and stands[i + 1] and on else 0.0
        if not waited:
            first, last = i == 1 or stands[i - 1], i + 1 == len(time) or stands[i + 1]
            texts = tuple(notes[i]), tuple(switched[i])
            yield ProgramStep(i, step, stands[i], first, last, *texts)
        else:
            notes[i + 1] = notes[i]


def _stands(points: Positions) -> Iterator[bool]:
    """Whether the arm is at rest between two points; times are rounded by half a tick."""
    motion = points.trajectory
    for start, end in zip(points.time[:-1], points.time[1:], strict=True):
        inside = np.array([start + 0.5 * TIME_TICK, 0.5 * (start + end), end - 0.5 * TIME_TICK])
        within = np.minimum(motion.start_time + inside, motion.end_time)
        yield end - start > 1.5 * TIME_TICK and bool(
            np.abs(motion.velocity(within)).max() <= RESTING_SPEED
        )


def _events_by_point(points: Positions) -> Iterator[tuple[Event, int]]:
    """Events with the indices of their points."""
    for event in points.trajectory.events:
        time = event.time - points.trajectory.start_time
        yield event, int(np.abs(points.time - time).argmin())


def _at_start(points: Positions) -> list[Event]:
    return [event for event, i in _events_by_point(points) if i == 0]


def _signal(event: Event) -> str:
    """The name of an event's signal in RAPID.

    Raises:
        ExportError: The event has no valid name, or another value than on or off.
    """
    name = f"do{event.output}" if event.name.startswith("output ") else event.name
    if not re.fullmatch(r"[A-Za-z]\w{0,31}", name, re.ASCII) or not isinstance(event.value, bool):
        raise _unsupported_event(event, "ABB", "a signal named by letters, digits and _")
    return name


def _set_output(event: Event) -> str:
    return f"    SetDO {_signal(event)}, {int(bool(event.value))};"


def _number(event: Event, maker: str) -> int:
    """The output of an event.

    Raises:
        ExportError: The event has no output.
    """
    if not event.output or not isinstance(event.value, bool):
        known = f"the number of an output from 1 on, given by outputs: {{{event.name}: number}}"
        raise _unsupported_event(event, maker, known)
    return event.output


def _unsupported_event(event: Event, maker: str, known: str) -> ExportError:
    return ExportError(
        f"{event.text} at {event.time:.3f} s, {waypoint_text(event.waypoint)}: a program for "
        f"{maker} can't switch it; accepted: on and off, with {known}; or --without-events",
        time=event.time,
    )


def _about(points: Positions, maker: str, further: Mapping[str, str]) -> Iterator[str]:
    motion = points.trajectory
    yield f"A motion of {motion.duration:.6g} s for a controller of {maker}."
    yield f"{points.describe()}."
    arm = (name for name in motion.joint_names if name not in further)
    yield f"Joints: {', '.join(map(_ascii, arm))}, in deg."
    if further:
        named = (f"{_ascii(name)} [{unit}]" for name, unit in further.items())
        yield f"External axes: {', '.join(named)}."
    yield "Try it in a simulator first."


def _ascii(name: str) -> str:
    """A name in one line of ASCII: text after a line break would be a part of the program."""
    return ascii(name)[1:-1]


def _text(lines: list[str]) -> str:
    return "\n".join(lines) + "\n"
