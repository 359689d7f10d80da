"""Nonlinear programs of a few small functions, each repeated many times, solved by IPOPT.

All intervals of a motion have the same equations. A `Kernel` has them once, with their
derivatives; a `Program` maps it over columns of variables and assembles the sparse Jacobian and
Hessian by index. So the setup time does not depend on the length of the motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.waypoints import FloatArray, IndexArray

OPTIONS: dict[str, Any] = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.linear_solver": "mumps",
    "ipopt.tol": 1e-8,
    "ipopt.constr_viol_tol": 1e-8,
    "ipopt.acceptable_iter": 0,
    "ipopt.mumps_scaling": 0,
    "ipopt.mumps_permuting_scaling": 0,
    "ipopt.mumps_pivot_order": 4,
    "ipopt.max_iter": 200,
}


class Kernel:
    """Constraints and cost of one repeated part, with their derivatives.

    Args:
        z: Variables, a symbolic column.
        p: Parameters, a symbolic column.
        g: Constraints, a symbolic column.
        cost: Term of the objective.
        inner: Symbols in `g` and `cost` for expressions of the variables, and these expressions.
            By the chain rule, derivatives of long expressions in few inner symbols take a
            fraction of the operations.
    """

    def __init__(
        self, z: Any, p: Any, g: Any, cost: Any = 0.0, inner: tuple[Any, Any] | None = None
    ) -> None:
        import casadi as ca

        cost, g = ca.densify(ca.SX(cost)), ca.densify(ca.SX(g))
        self.variables, self.parameters, self.constraints = z.numel(), p.numel(), g.numel()
        multipliers, weight = ca.SX.sym("l", self.constraints), ca.SX.sym("w")
        symbols, meant = inner or (ca.SX(0, 1), ca.SX(0, 1))
        both = ca.vertcat(z, symbols)
        change = ca.vertcat(ca.SX.eye(self.variables), ca.jacobian(meant, z))
        bent, slope = ca.hessian(weight * cost + ca.dot(multipliers, g), both)
        pull = ca.SX.sym("pull", symbols.numel())
        turned = ca.substitute(
            ca.hessian(ca.dot(pull, meant), z)[0], pull, slope[self.variables :, :]
        )
        gradient = ca.densify(ca.mtimes(ca.gradient(cost, both).T, change).T)
        jacobian = ca.mtimes(ca.jacobian(g, both), change)
        hessian = ca.mtimes(change.T, ca.mtimes(bent, change)) + turned
        found = [cost, g, gradient, jacobian, hessian]
        at = ca.Function("at", [both, p, weight, multipliers], found)
        cost, g, gradient, jacobian, hessian = at(ca.vertcat(z, meant), p, weight, multipliers)
        self.value = ca.Function("value", [z, p], [cost, g])
        self.first = ca.Function("first", [z, p], [gradient, jacobian])
        self.second = ca.Function("second", [z, p, weight, multipliers], [hessian])


@dataclass(frozen=True, eq=False)
class Block:
    """A kernel with the variables of its repetitions.

    Attributes:
        kernel: The kernel.
        index: Indices of its variables in the program, a column for each repetition, shape
            (variables, times).
    """

    kernel: Kernel
    index: IndexArray

    @property
    def times(self) -> int:
        """Number of repetitions of the kernel."""
        return int(self.index.shape[1])

    def chosen(self, size: int) -> Any:
        """The matrix that selects its variables, repetition by repetition, from a program's.

        Args:
            size: Number of variables of the program.
        """
        import casadi as ca

        columns = self.index.T.ravel()
        rows = range(len(columns))
        return ca.DM.ones(ca.Sparsity.triplet(len(columns), size, list(rows), columns.tolist()))


@dataclass(frozen=True, eq=False)
class Solution:
    """Result of the solver.

    Attributes:
        x: Variables.
        multipliers: Multipliers of the bounds of the variables, then of the constraints.
        solved: Whether IPOPT converged.
        iterations: Number of steps.
    """

    x: FloatArray
    multipliers: FloatArray
    solved: bool
    iterations: int


class Program:
    """Minimise the sum of the costs of all blocks under their constraints.

    Args:
        size: Number of variables.
        blocks: Blocks. Constraints are ordered by block, then by repetition.
        options: IPOPT options in addition to `OPTIONS`.
    """

    def __init__(
        self,
        size: int,
        blocks: Sequence[Block],
        options: dict[str, Any] | None = None,
    ) -> None:
        self.size, self.blocks = size, tuple(b for b in blocks if b.times)
        self.constraints = sum(b.kernel.constraints * b.times for b in self.blocks)
        self._set_up(OPTIONS | (options or {}))

    def _set_up(self, options: dict[str, Any]) -> None:
        import casadi as ca

        x, weight = ca.MX.sym("x", self.size), ca.MX.sym("w")
        p = ca.MX.sym("p", sum(b.kernel.parameters * b.times for b in self.blocks))
        multipliers = ca.MX.sym("l", self.constraints)
        cost, gradient, hessian = ca.MX(0.0), ca.MX(self.size, 1), ca.MX(self.size, self.size)
        constraints, jacobians = [], []
        given, dual = 0, 0
        for block in self.blocks:
            kernel, times, chosen = block.kernel, block.times, block.chosen(self.size)
            z = ca.reshape(ca.mtimes(chosen, x), kernel.variables, times)
            q = ca.reshape(p[given : given + kernel.parameters * times], kernel.parameters, times)
            own = kernel.constraints * times
            factors = ca.reshape(multipliers[dual : dual + own], kernel.constraints, times)
            given, dual = given + q.numel(), dual + own
            costs, g = kernel.value.map(times)(z, q)
            slope, jacobian = kernel.first.map(times)(z, q)
            bent = kernel.second.map(times)(z, q, ca.repmat(weight, 1, times), factors)
            cost += ca.sum2(costs)
            gradient += ca.mtimes(chosen.T, ca.vec(slope))
            constraints.append(ca.vec(g))
            jacobians.append(ca.mtimes(_diagonal(jacobian, times), chosen))
            hessian += ca.mtimes(chosen.T, ca.mtimes(_diagonal(bent, times), chosen))
        g, names = ca.vertcat(*constraints), ["x", "p"]
        derivatives = {
            "grad_f": ca.Function(
                "grad_f", [x, p], [cost, ca.densify(gradient)], names, ["f", "grad_f_x"]
            ),
            "jac_g": ca.Function(
                "jac_g", [x, p], [g, ca.vertcat(*jacobians)], names, ["g", "jac_g_x"]
            ),
            "hess_lag": ca.Function(
                "hess_lag",
                [x, p, weight, multipliers],
                [ca.triu(hessian)],
                [*names, "lam_f", "lam_g"],
                ["triu_hess_gamma_x_x"],
            ),
        }
        self._solver = ca.nlpsol(
            "least", "ipopt", {"x": x, "p": p, "f": cost, "g": g}, derivatives | options
        )

    def solve(
        self,
        start: FloatArray | Solution,
        bounds: tuple[FloatArray, FloatArray],
        parameters: Sequence[FloatArray],
        limits: Sequence[tuple[FloatArray, FloatArray]],
    ) -> Solution:
        """Solve from a start.

        Args:
            start: Initial variables, shape (size,), or an earlier solution.
            bounds: Lower and upper bounds of the variables.
            parameters: Parameters of each block, shape (parameters, times).
            limits: Lower and upper bounds of each block's constraints, shape (constraints, times)
                each.
        """
        low, high = joined_limits(limits)
        known = {}
        if isinstance(start, Solution):
            parts = np.split(start.multipliers, [self.size])
            known = dict(zip(("lam_x0", "lam_g0"), parts, strict=True))
            start = start.x
        found = self._solver(
            x0=start,
            **known,
            lbx=bounds[0],
            ubx=bounds[1],
            p=np.concatenate([np.ravel(p, order="F") for p in parameters]),
            lbg=low,
            ubg=high,
        )
        stats = self._solver.stats()
        return Solution(
            np.array(found["x"]).ravel(),
            np.concatenate([np.array(found[name]).ravel() for name in ("lam_x", "lam_g")]),
            bool(stats["success"]),
            int(stats["iter_count"]),
        )


def joined_limits(limits: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bounds of all constraints, in the program's order."""
    low, high = zip(*limits, strict=True)
    return (
        np.concatenate([np.ravel(one, order="F") for one in low]),
        np.concatenate([np.ravel(one, order="F") for one in high]),
    )


def _diagonal(parts: Any, times: int) -> Any:
    """The block diagonal matrix of n horizontally stacked parts."""
    import casadi as ca

    if times == 1:
        return parts
    part = ca.DM.ones(ca.horzsplit(parts, parts.size2() // times)[0].sparsity())
    return ca.MX(ca.kron(ca.DM.eye(times), part).sparsity(), ca.vec(parts.nz[:]))
