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
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knotwork.curves.trajectory import Event, JointTrajectory
from knotwork.errors import ExportError
from knotwork.files.export.labels import one_ascii_line, unsupported_event
from knotwork.files.export.straight import (
    ARM_AXES,
    RESTING_SPEED,
    STRAIGHT,
    TIME_TICK,
    StraightPoints,
    bound_text,
    controller_axes,
    from_horizontal,
    straight_points,
)

if TYPE_CHECKING:
    from knotwork.robot import Robot

MAX_REMARK_LENGTH = 32
"""Maximum number of characters of a FANUC remark."""
MAX_TRIGGERS = 8
"""Maximum number of triggers of one ABB move."""
RAPID_WORDS = re.compile(
    "alias|and|backward|case|connect|const|default|div|do|else|elseif|"
    "end(for|func|if|module|proc|record|test|trap|while)|error|exit|false|for|from|func|goto|if|"
    "inout|local|mod|module|nostepin|not|noview|or|pers|proc|raise|readonly|record|retry|return|"
    "step|sysmodule|task|test|then|to|trap|true|trynext|undo|var|viewonly|while|with|xor",
    re.IGNORECASE,
)
"""Reserved words of RAPID."""


@dataclass(frozen=True)
class ProgramStep:
    """The step from one point to the next.

    Attributes:
        to: Index of the point.
        time: Duration [s].
        moving_time: Time at its end since the arm was last at rest [s].
        at_rest: Whether the arm is at rest.
        starts, stops: Whether the arm starts to move, or comes to rest at the end.
        notes: Names of the segments that begin with the step.
        events_in_motion: Events at its end that are switched while the arm moves.
        events_at_rest: Events at its end that are switched at rest.
    """

    to: int
    time: float
    moving_time: float
    at_rest: bool
    starts: bool
    stops: bool
    notes: tuple[str, ...]
    events_in_motion: tuple[Event, ...]
    events_at_rest: tuple[Event, ...]


def to_krl(
    motion: JointTrajectory | StraightPoints,
    *,
    tolerance: float | None = None,
    robot: Robot | None = None,
) -> str:
    """Write a program for a controller of KUKA: spline blocks of axis positions, with times.

    The controller draws a spline through the points (KSS 8.3 and later). Its algorithm is not
    published; the points are close enough for straight lines.

    >>> import knotwork as kw
    >>> to_krl(kw.plan("ur5_deburring").trajectory).count("SPTP {")
    66

    Args:
        motion: From rest to rest, of an arm with six revolute axes, base first; sliding joints are
            external axes. Or points of it from `knotwork.files.export.straight_points`.
        tolerance: Largest error of straight lines between points [rad or m]; by default 1e-3.
        robot: Robot with the revolute external axes, those of tables and positioners.

    Raises:
        ExportError: The motion moves at an end, the arm has other axes, or an event has no
            output.
        InputError: The tolerance is out of range.
    """
    points = straight_points(motion, **STRAIGHT["krl"], tolerance=tolerance)
    arm, external, external_units = controller_axes(points, points.position, robot)
    names = [f"A{j + 1}" for j in range(ARM_AXES)] + [f"E{j + 1}" for j in range(external.shape[1])]

    def axes(i: int) -> str:
        values = zip(names, (*arm[i], *external[i]), strict=True)
        return "{" + ", ".join(f"{name} {value:.6f}" for name, value in values) + "}"

    def switch(event: Event) -> str:
        return f"$OUT[{_output_number(event, 'KUKA')}]={'TRUE' if event.value else 'FALSE'}"

    def move(step: ProgramStep) -> Iterator[str]:
        if step.starts:
            yield from ("PTP_SPLINE", "  TIME_BLOCK START")
        for event in step.events_in_motion:
            yield f"  TRIGGER WHEN PATH=0 DELAY=0 DO {switch(event)}"
        yield f"  SPTP {axes(step.to)}"
        # parts are proportions of the time at the end of the block
        yield f"  TIME_BLOCK PART = {step.time:.3f}"
        if step.stops:
            yield from (f"  TIME_BLOCK END = {step.moving_time:.3f}", "ENDSPLINE")

    about = (*_about(points, "KUKA", external_units), "File: knotwork_motion.src.")
    begin = [*(f"; {line}" for line in about), "BAS(#INITMOV, 0)", f"PTP {axes(0)}"]
    body = _body(points, _steps(points), "; {}", "WAIT SEC {:.3f}", switch, move)
    return _text(["DEF knotwork_motion()", *_indented(begin + body), "END"])


def to_rapid(
    motion: JointTrajectory | StraightPoints,
    *,
    tolerance: float | None = None,
    robot: Robot | None = None,
) -> str:
    """Write a module for a controller of ABB: moves between axis positions, with times.

    Arguments and errors are those of `to_krl`. A signal keeps its name, or is `do3` for output 3
    without a name.

    >>> import knotwork as kw
    >>> to_rapid(kw.plan("ur5_deburring").trajectory).count("MoveAbsJ kw_q")
    67
    """
    points = straight_points(motion, **STRAIGHT["rapid"], tolerance=tolerance)
    arm, external, external_units = controller_axes(points, points.position, robot)
    unused = ["9E9"] * (ARM_AXES - external.shape[1])
    targets = []
    for angles, values in zip(arm, external, strict=True):
        written = [f"{value:.6f}" for value in values] + unused
        targets.append(f"  [[{','.join(f'{x:.6f}' for x in angles)}],[{','.join(written)}]]")
    program = list(_steps(points))
    flying = [event for step in program for event in step.events_in_motion]
    triggers = {event: f"kw_t{n}" for n, event in enumerate(flying, 1)}

    def switch(event: Event) -> str:
        return f"SetDO {_signal(event)}, {int(bool(event.value))};"

    def move(step: ProgramStep) -> Iterator[str]:
        if len(step.events_in_motion) > MAX_TRIGGERS:
            signals = f"{len(step.events_in_motion)} signals at {points.time[step.to]:.6g} s"
            raise ExportError(f"{signals}; an ABB move switches at most {MAX_TRIGGERS}")
        first, *others = [triggers[event] for event in step.events_in_motion] or [""]
        name = "TriggAbsJ" if first else "MoveAbsJ"
        names = first + "".join(rf"\T{n}:={other}" for n, other in enumerate(others, 2))
        zone = ("fine" if step.stops else "z0") if not first else f"{names}, z0"
        yield rf"{name} kw_q{{{step.to + 1}}}\NoEOffs, v5000\T:={step.time:.3f}, {zone}, tool0;"

    data = [
        *(f"! {line}" for line in _about(points, "ABB", external_units)),
        f"CONST jointtarget kw_q{{{len(targets)}}} := [",
        *",\n".join(targets).split("\n"),
        "];",
        *(f"VAR triggdata {name};" for name in triggers.values()),
    ]
    steps = [
        rf"TriggIO {name}, 0\Time\DOp:={_signal(event)}, {int(bool(event.value))};"
        for event, name in triggers.items()
    ]
    steps.append(r"MoveAbsJ kw_q{1}\NoEOffs, v100, fine, tool0;")
    steps += _body(points, program, "! {}", r"WaitTime\InPos, {:.3f};", switch, move)
    routine = ["PROC knotwork_motion()", *_indented(steps), "ENDPROC"]
    return _text(["MODULE KnotworkMotion", *_indented(data + routine), "ENDMODULE"])


def to_ls(
    motion: JointTrajectory | StraightPoints,
    *,
    tolerance: float | None = None,
    robot: Robot | None = None,
) -> str:
    """Write a program for a controller of FANUC: joint moves with times.

    Arguments and errors are those of `to_krl`. The angle J3 counts from the horizontal: it is
    joint 3 less joint 2 of a URDF of ROS-Industrial.

    >>> import knotwork as kw
    >>> to_ls(kw.plan("ur5_deburring").trajectory).count("msec CNT100")
    65
    """
    points = straight_points(motion, **STRAIGHT["ls"], tolerance=tolerance)
    arm, external, external_units = controller_axes(points, from_horizontal(points, robot), robot)

    def switch(event: Event) -> str:
        return f"  DO[{_output_number(event, 'FANUC')}]={'ON' if event.value else 'OFF'}"

    def move(step: ProgramStep) -> Iterator[str]:
        end = "FINE" if step.stops else "CNT100"
        # one output can be switched with a move, and others after it
        first, *others = map(switch, step.events_in_motion) if step.events_in_motion else [""]
        with_move = f" TB .00sec,{first.lstrip()}" if first else ""
        yield f"J P[{step.to + 1}] {round(step.time / TIME_TICK)}msec {end}{with_move}"
        yield from others

    about = f"{points.time[-1]:.3f} s, lines {bound_text(points.error, 2)} off"
    remark = f"  !{{:.{MAX_REMARK_LENGTH}}}"
    moves = [remark.format(about), "J P[1] 10% FINE"]
    moves += _body(points, _steps(points), remark, "  WAIT {:.2f}(sec)", switch, move)
    lines = ["/PROG  KNOTWORK", "/ATTR", 'COMMENT = "KNOTWORK";', "DEFAULT_GROUP = 1,*,*,*,*;"]
    lines += ["/MN", *(f"{i:4}:{line} ;" for i, line in enumerate(moves, 1)), "/POS"]
    for i in range(points.time.size):
        values = [f"J{j + 1} = {value:.4f} deg" for j, value in enumerate(arm[i])]
        pairs = zip(external[i], external_units.values(), strict=True)
        values += [f"E{j} = {value:.4f} {unit}" for j, (value, unit) in enumerate(pairs, 1)]
        lines += [f"P[{i + 1}]{{", "   GP1:", "  UF : F, UT : F,", f"  {', '.join(values)}", "};"]
    return _text([*lines, "/END"])


def _body(
    points: StraightPoints,
    steps: Iterable[ProgramStep],
    remark: str,
    wait: str,
    switch: Callable[[Event], str],
    move: Callable[[ProgramStep], Iterable[str]],
) -> list[str]:
    """Lines after the move to the first point: names of segments, moves, waits, and outputs."""
    lines = [switch(event) for event, i in _events_by_point(points) if i == 0]
    for step in steps:
        lines += [remark.format(note) for note in step.notes]
        lines += [wait.format(step.time)] if step.at_rest else move(step)
        lines += map(switch, step.events_at_rest)
    return lines


def _steps(points: StraightPoints) -> Iterator[ProgramStep]:
    """List the steps between points, with the events at their ends; a rest is one step."""
    motion, time = points.trajectory, points.time
    switched: list[list[Event]] = [[] for _ in time]
    for event, i in _events_by_point(points):
        switched[i].append(event)
    notes: list[list[str]] = [[] for _ in time]
    for segment in motion.segments:
        start = segment.start - motion.start_time + 0.5 * TIME_TICK
        i = int(np.searchsorted(time, start, "right"))
        notes[min(i, len(time) - 1)].append(one_ascii_line(segment.name))
    at_rest = [True, *_find_rests(points), True]
    ends = [
        i
        for i in range(1, len(time) - 1)
        if not (at_rest[i] and at_rest[i + 1]) or switched[i] or notes[i + 1]
    ]
    moving_time = 0.0
    for before, i in pairwise([0, *ends, len(time) - 1]):
        duration = float(time[i] - time[before])
        moving_time = 0.0 if at_rest[i] else moving_time + duration
        moves_on = not (at_rest[i] or at_rest[i + 1])
        yield ProgramStep(
            to=i,
            time=duration,
            moving_time=moving_time,
            at_rest=at_rest[i],
            starts=at_rest[before],
            stops=at_rest[i + 1],
            notes=tuple(notes[before + 1]),
            events_in_motion=tuple(switched[i]) if moves_on else (),
            events_at_rest=() if moves_on else tuple(switched[i]),
        )


def _find_rests(points: StraightPoints) -> list[bool]:
    """Whether the arm is at rest between two points; times are rounded by half a tick."""
    motion = points.trajectory
    start, end = points.time[:-1], points.time[1:]
    inside = np.array([start + 0.5 * TIME_TICK, 0.5 * (start + end), end - 0.5 * TIME_TICK])
    clock = np.minimum(motion.start_time + inside, motion.end_time)
    speed = np.abs(motion.velocity(clock)).max(axis=(0, 2))
    at_rest = (end - start > 1.5 * TIME_TICK) & (speed <= RESTING_SPEED)
    return [bool(rests) for rests in at_rest]


def _events_by_point(points: StraightPoints) -> Iterator[tuple[Event, int]]:
    """List events, each with the index of the point nearest in time."""
    for event in points.trajectory.events:
        time = event.time - points.trajectory.start_time
        yield event, int(np.abs(points.time - time).argmin())


def _signal(event: Event) -> str:
    """The name of an event's signal in RAPID.

    Raises:
        ExportError: The event has no usable name, or another value than on or off.
    """
    name = f"do{event.output}" if event.name.startswith("output ") else event.name
    is_name = re.fullmatch(r"(?!kw_|knotwork)[a-z]\w{0,31}", name, re.ASCII | re.IGNORECASE)
    if not is_name or RAPID_WORDS.fullmatch(name) or not isinstance(event.value, bool):
        accepted = "a signal named by letters, digits and _, not a word of RAPID, kw_… or knotwork…"
        raise unsupported_event(event, "ABB", accepted)
    return name


def _output_number(event: Event, maker: str) -> int:
    """The output of an event.

    Raises:
        ExportError: The event has no output.
    """
    if not event.output or not isinstance(event.value, bool):
        accepted = f"the number of an output from 1 on, given by outputs: {{{event.name}: number}}"
        raise unsupported_event(event, maker, accepted)
    return event.output


def _about(points: StraightPoints, maker: str, external_units: Mapping[str, str]) -> Iterator[str]:
    motion = points.trajectory
    yield f"A motion of {motion.duration:.6g} s for a controller of {maker}."
    yield f"{points.describe()}."
    arm = (name for name in motion.joint_names if name not in external_units)
    yield f"Joints: {', '.join(map(one_ascii_line, arm))}, in deg."
    if external_units:
        named = (f"{one_ascii_line(name)} [{unit}]" for name, unit in external_units.items())
        yield f"External axes: {', '.join(named)}."
    yield "Try it in a simulator first."


def _indented(lines: Iterable[str]) -> list[str]:
    return [f"  {line}" for line in lines]


def _text(lines: list[str]) -> str:
    return "\n".join(lines) + "\n"
