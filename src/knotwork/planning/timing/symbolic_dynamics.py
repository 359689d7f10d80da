"""Symbolic inverse dynamics and tool speed, from the inertias of a Pinocchio model.

The recursive Newton-Euler algorithm (Featherstone, Rigid Body Dynamics Algorithms, 2008, section
5.3) in link coordinates: velocities and accelerations outwards, forces inwards. Gravity is an
acceleration of the base.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.robot.joint_tree import JointTree, joint_tree
from knotwork.robot.many_states import joint_efforts


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Joint efforts and tool speed of a robot, as numbers and as symbols for the solver.

    Payload and `robot.gravity` are included as in `Robot.effort`.

    Attributes:
        robot: The arm, with the joints of the problem in the same order.
        tree: The joint tree, each joint after its parent.

    Raises:
        InputError: A joint has several degrees of freedom.

    >>> arm = Dynamics(kw.load_robot("planar2"))
    >>> still = np.zeros(2)
    >>> np.allclose(arm.effort(still, still, still), arm.robot.effort(still, still, still))
    True
    """

    robot: Robot
    tree: JointTree = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "tree", joint_tree(self.robot.model))

    def effort(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """Joint efforts [N m or N] of many states, shape (..., d) each, by Pinocchio."""
        return joint_efforts(self.robot.model, q, v, a)

    def symbolic_effort(self, q: Any, v: Any, a: Any) -> Any:
        """Joint efforts of a state as CasADi symbols, a column."""
        import casadi as ca

        moving = self._outwards(q, v, a)
        tree, effort = self.tree, [ca.SX(0)] * len(moving)
        forces, moments = (
            [None, *(getattr(link, name) for link in moving[1:])] for name in ("force", "moment")
        )
        for i in reversed(range(1, len(moving))):
            link, parent, k = moving[i], tree.parent[i], tree.column[i]
            along = tree.angle_per_unit[i] * moments[i] + tree.length_per_unit[i] * forces[i]
            effort[k] = ca.dot(_sparse(tree.axis[i]), along)
            effort[k] += float(self.robot.model.armature[k]) * a[k]
            if parent:
                force = ca.mtimes(link.rotation, forces[i])
                forces[parent] += force
                moments[parent] += ca.mtimes(link.rotation, moments[i])
                moments[parent] += ca.cross(link.offset, force)
        return ca.vertcat(*effort[:-1])

    def symbolic_tool_velocity(self, q: Any, v: Any) -> Any:
        """Velocity of the tool centre point as CasADi symbols, in its link's axes, a column."""
        import casadi as ca

        model = self.robot.model
        if self.robot.tcp_frame_id is None:
            raise InputError(f"robot {self.robot.name!r} has no tool frame; choose one")
        frame = model.frames[self.robot.tcp_frame_id]
        if frame.parentJoint == 0:
            return ca.SX.zeros(3)
        link = self._outwards(q, v, v)[frame.parentJoint]
        return link.velocity + ca.cross(link.spin, ca.DM(np.array(frame.placement.translation)))

    def _outwards(self, q: Any, v: Any, a: Any) -> list[_Moving]:
        """Motion of every link from the base to the tips, and the required force and moment."""
        import casadi as ca

        model, tree, none = self.robot.model, self.tree, ca.SX(3, 1)
        # gravity is an acceleration of the base
        lift = ca.SX(ca.DM(-model.gravity.linear))
        links = [_Moving(ca.SX.eye(3), none, none, none, none, lift, none, none)]
        for i in range(1, len(tree.parent)):
            k, parent, axis = tree.column[i], links[tree.parent[i]], tree.axis[i]
            turn, slide = (
                _sparse(tree.angle_per_unit[i] * axis),
                _sparse(tree.length_per_unit[i] * axis),
            )
            fixed = _sparse(tree.rotation[i])
            rotation = ca.mtimes(fixed, _rotation(tree.angle_per_unit[i] * axis, q[k]))
            offset = _sparse(tree.translation[i]) + ca.mtimes(fixed, slide * q[k])
            spin, spin_rate = parent.spin, parent.spin_rate
            velocity = parent.velocity + ca.cross(spin, offset)
            acceleration = (
                parent.acceleration
                + ca.cross(spin_rate, offset)
                + ca.cross(spin, ca.cross(spin, offset))
            )
            carried, moves = ca.mtimes(rotation.T, spin), slide * v[k]
            spin = carried + turn * v[k]
            spin_rate = ca.mtimes(rotation.T, spin_rate) + turn * a[k]
            spin_rate += ca.cross(carried, turn * v[k])
            acceleration = ca.mtimes(rotation.T, acceleration) + slide * a[k]
            acceleration += 2.0 * ca.cross(carried, moves)
            body = model.inertias[i]
            lever, inertia = _sparse(body.lever), _sparse(body.inertia)
            at_centre = acceleration + ca.cross(spin_rate, lever)
            force = float(body.mass) * (at_centre + ca.cross(spin, ca.cross(spin, lever)))
            moment = ca.mtimes(inertia, spin_rate) + ca.cross(spin, ca.mtimes(inertia, spin))
            moment += ca.cross(lever, force)
            velocity = ca.mtimes(rotation.T, velocity) + moves
            links.append(
                _Moving(rotation, offset, spin, spin_rate, velocity, acceleration, force, moment)
            )
        return links


class _Moving(NamedTuple):
    """A link's placement in its parent and its motion as symbols, in its axes."""

    rotation: Any
    offset: Any
    spin: Any
    spin_rate: Any
    velocity: Any
    acceleration: Any
    force: Any
    moment: Any


def _sparse(values: FloatArray) -> Any:
    """Sparse constants, so that products with zeros are dropped from expressions."""
    import casadi as ca

    return ca.SX(ca.sparsify(np.array(values)))


def _rotation(turn: FloatArray, angle: Any) -> Any:
    """Rotation about a unit axis (Rodrigues), or the identity for a zero axis."""
    import casadi as ca

    x, y, z = turn
    cross = _sparse(np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]))
    square = _sparse(np.outer(turn, turn) - float(turn @ turn) * np.eye(3))
    # this form drops products with zeros from the expressions
    return ca.SX.eye(3) + ca.sin(angle) * cross + (1.0 - ca.cos(angle)) * square
