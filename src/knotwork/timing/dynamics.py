"""Inverse dynamics and the tool's speed as symbols, from the inertias of a Pinocchio model.

The recursive Newton-Euler algorithm (Featherstone, Rigid Body Dynamics Algorithms, 2008, section
5.3) in link coordinates: velocities and accelerations outwards, forces inwards. Gravity is an
acceleration of the base.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.robot.joint_tree import joint_tree
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class Link:
    """A joint and the link that it moves.

    Attributes:
        parent: Index of the link that carries it; -1 for the base.
        column: Index of its position among the joints.
        rotation: Axes of the joint at position 0 in those of the parent, shape (3, 3).
        offset: Its origin in the parent [m], shape (3,).
        turn: What it turns by for one unit of its position, along its own axes, shape (3,).
        slide: What it slides by, shape (3,).
        mass: [kg].
        lever: Centre of mass in its axes [m], shape (3,).
        inertia: About the centre of mass [kg m²], shape (3, 3).
        armature: Inertia of its motor, as the joint feels it [kg m² or kg].
    """

    parent: int
    column: int
    rotation: FloatArray
    offset: FloatArray
    turn: FloatArray
    slide: FloatArray
    mass: float
    lever: FloatArray
    inertia: FloatArray
    armature: float


@dataclass(frozen=True, eq=False)
class Dynamics:
    """What the joint efforts and the tool's speed of a robot depend on.

    The payload and `robot.gravity` count as in `Robot.torque`.

    Attributes:
        robot: The arm. Its joints are those of the problem, in the same order.
        links: Its joints and links, each after the one that carries it.
        gravity: In the axes of the base link [m/s²], shape (3,).

    Raises:
        InputError: A joint has several degrees of freedom.

    >>> arm = Dynamics(kw.load_robot("planar2"))
    >>> still = np.zeros(2)
    >>> np.allclose(arm.effort(still, still, still), arm.robot.torque(still, still, still))
    True
    """

    robot: Robot
    links: tuple[Link, ...] = field(init=False)
    gravity: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "links", _links(self.robot.model))
        object.__setattr__(self, "gravity", np.array(self.robot.model.gravity.linear))

    def effort(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """Joint efforts [N m or N] of many states, shape (..., d) each, by Pinocchio."""
        model, data = self.robot.model, self.robot.data
        shape = np.shape(q)
        rows = zip(*(np.reshape(x, (-1, shape[-1])) for x in (q, v, a)), strict=True)
        return np.array([pin.rnea(model, data, *row) for row in rows]).reshape(shape)

    def tool_speed(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Speed of the tool centre point [m/s] in many states, shape (...) for (..., d)."""
        shape = np.shape(q)
        rows = zip(*(np.reshape(x, (-1, shape[-1])) for x in (q, v)), strict=True)
        found = [float(np.linalg.norm(self.robot.twist(*row).linear)) for row in rows]
        return np.array(found).reshape(shape[:-1])

    def symbolic_effort(self, q: Any, v: Any, a: Any) -> Any:
        """Joint efforts of a state as CasADi symbols, a column."""
        import casadi as ca

        moving = _outwards(self.links, self.gravity, q, v, a)
        effort: list[Any] = [None] * len(self.links)
        forces = [motion.force for motion in moving]
        moments = [motion.moment for motion in moving]
        for i in reversed(range(len(self.links))):
            link, here = self.links[i], moving[i]
            own = ca.dot(ca.DM(link.turn), moments[i]) + ca.dot(ca.DM(link.slide), forces[i])
            effort[link.column] = own + link.armature * a[link.column]
            if link.parent >= 0:
                force = ca.mtimes(here.rotation, forces[i])
                forces[link.parent] += force
                moments[link.parent] += ca.mtimes(here.rotation, moments[i]) + ca.cross(
                    here.offset, force
                )
        return ca.vertcat(*effort)

    def symbolic_tool_velocity(self, q: Any, v: Any) -> Any:
        """Velocity of the tool centre point as CasADi symbols, in its link's axes, a column."""
        import casadi as ca

        model = self.robot.model
        if self.robot.tcp_frame_id is None:
            raise InputError(f"robot {self.robot.name!r} has no tool frame; choose one")
        frame = model.frames[self.robot.tcp_frame_id]
        if frame.parentJoint == 0:
            return ca.SX.zeros(3)
        here = _outwards(self.links, self.gravity, q, v, v)[frame.parentJoint - 1]
        return here.velocity + ca.cross(here.spin, ca.DM(np.array(frame.placement.translation)))


@dataclass(eq=False)
class _Moving:
    """A link's motion as symbols, in its axes: see `_outwards`."""

    rotation: Any
    offset: Any
    spin: Any
    velocity: Any
    force: Any
    moment: Any
    spin_rate: Any
    acceleration: Any


def _outwards(
    links: tuple[Link, ...], gravity: FloatArray, q: Any, v: Any, a: Any
) -> list[_Moving]:
    """Motion of every link from the base to the tips, and the force and moment it takes."""
    import casadi as ca

    nothing = ca.SX(3, 1)
    found: list[_Moving] = []
    for link in links:
        angle, rate, change = q[link.column], v[link.column], a[link.column]
        turn, slide = ca.SX(ca.sparsify(link.turn)), ca.SX(ca.sparsify(link.slide))
        rotation = ca.mtimes(ca.sparsify(link.rotation), _turned(link.turn, angle))
        offset = ca.sparsify(link.offset) + ca.mtimes(ca.sparsify(link.rotation), slide * angle)
        back = rotation.T
        if link.parent < 0:
            spin = velocity = spin_rate = nothing
            acceleration = ca.SX(ca.DM(-gravity))
        else:
            parent = found[link.parent]
            spin, spin_rate = parent.spin, parent.spin_rate
            velocity = parent.velocity + ca.cross(spin, offset)
            acceleration = (
                parent.acceleration
                + ca.cross(spin_rate, offset)
                + ca.cross(spin, ca.cross(spin, offset))
            )
        carried = ca.mtimes(back, spin)
        own = carried + turn * rate
        own_rate = ca.mtimes(back, spin_rate) + turn * change + ca.cross(carried, turn * rate)
        moves = slide * rate
        velocity = ca.mtimes(back, velocity) + moves
        acceleration = (
            ca.mtimes(back, acceleration) + slide * change + 2.0 * ca.cross(carried, moves)
        )
        lever, inertia = ca.sparsify(link.lever), ca.sparsify(link.inertia)
        at_centre = acceleration + ca.cross(own_rate, lever) + ca.cross(own, ca.cross(own, lever))
        force = link.mass * at_centre
        moment = (
            ca.mtimes(inertia, own_rate)
            + ca.cross(own, ca.mtimes(inertia, own))
            + ca.cross(lever, force)
        )
        found.append(
            _Moving(rotation, offset, own, velocity, force, moment, own_rate, acceleration)
        )
    return found


def _turned(turn: FloatArray, angle: Any) -> Any:
    """Rotation about an axis (Rodrigues); the axis has length one, or zero for no rotation."""
    import casadi as ca

    x, y, z = turn
    cross = ca.sparsify(np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]))
    square = ca.sparsify(np.outer(turn, turn) - float(turn @ turn) * np.eye(3))
    # sin and cos as they stand keep the products with zeros out of the expressions
    return ca.SX.eye(3) + ca.sin(angle) * cross + (1.0 - ca.cos(angle)) * square


def _links(model: Any) -> tuple[Link, ...]:
    joints = joint_tree(model)
    return tuple(
        Link(
            parent=joints.parent[i] - 1,
            column=joints.column[i],
            rotation=joints.rotation[i],
            offset=joints.translation[i],
            turn=joints.turns[i] * joints.axis[i],
            slide=joints.slides[i] * joints.axis[i],
            mass=float(body.mass),
            lever=np.array(body.lever),
            inertia=np.array(body.inertia),
            armature=float(model.armature[joints.column[i]]),
        )
        for i, body in enumerate(model.inertias)
        if i
    )
