"""Nonlinear programs of a few small functions, each repeated many times, solved by IPOPT.

All intervals of a motion have the same equations. A `Kernel` has these equations once, with their
derivatives. `solve_program` maps it over columns of variables and assembles the sparse Jacobian and
Hessian by index. Thus the setup time does not depend on the length of the motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray, IndexArray

IPOPT_OPTIONS: dict[str, Any] = {
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
    """Constraints and cost of one unit that repeats, with their derivatives.

    Args:
        z: Variables, a symbolic column.
        p: Parameters, a symbolic column.
        g: Constraints, a symbolic column.
        cost: Term of the objective.
        inner: Symbols in `g` and `cost` for functions of the variables, and these functions. By the
            chain rule, derivatives by way of a few inner symbols need only a fraction of the
            operations.
    """

    def __init__(
        self, z: Any, p: Any, g: Any, cost: Any = 0.0, inner: tuple[Any, Any] | None = None
    ) -> None:
        import casadi as ca

        cost, g = ca.densify(ca.SX(cost)), ca.densify(ca.SX(g))
        self.variables, self.parameters, self.constraints = z.numel(), p.numel(), g.numel()
        multipliers, weight = ca.SX.sym("l", self.constraints), ca.SX.sym("w")
        symbols, inner_values = inner or (ca.SX(0, 1), ca.SX(0, 1))
        symbolic = ca.vertcat(z, symbols)
        change = ca.vertcat(ca.SX.eye(self.variables), ca.jacobian(inner_values, z))
        curvature, slope = ca.hessian(weight * cost + ca.dot(multipliers, g), symbolic)
        pull = ca.SX.sym("pull", symbols.numel())
        inner_curvature = ca.substitute(
            ca.hessian(ca.dot(pull, inner_values), z)[0], pull, slope[self.variables :, :]
        )
        gradient = ca.densify(ca.mtimes(ca.gradient(cost, symbolic).T, change).T)
        jacobian = ca.mtimes(ca.jacobian(g, symbolic), change)
        hessian = ca.mtimes(change.T, ca.mtimes(curvature, change)) + inner_curvature
        outputs = [cost, g, gradient, jacobian, hessian]
        at = ca.Function("at", [symbolic, p, weight, multipliers], outputs)
        cost, g, gradient, jacobian, hessian = at(
            ca.vertcat(z, inner_values), p, weight, multipliers
        )
        self.value = ca.Function("value", [z, p], [cost, g])
        self.first = ca.Function("first", [z, p], [gradient, jacobian])
        self.second = ca.Function("second", [z, p, weight, multipliers], [hessian])


@dataclass(frozen=True, eq=False)
class Block:
    """A kernel, repeated for columns of variables.

    Attributes:
        kernel: The kernel.
        index: Indices of its variables in the program, a column for each repetition, shape
            (variables, times).
        parameters: Parameters, of a shape that broadcasts to (parameters, times).
        low, high: Bounds of the constraints, of shapes that broadcast to (constraints, times); by
            default 0.
    """

    kernel: Kernel
    index: IndexArray
    parameters: FloatArray = field(default_factory=lambda: np.zeros((0, 1)))
    low: float | FloatArray = 0.0
    high: float | FloatArray = 0.0

    def column(self, values: float | FloatArray, rows: int) -> FloatArray:
        """Parameters or bounds of all repetitions, one after the other."""
        return np.ravel(np.broadcast_to(values, (rows, self.index.shape[1])), order="F")


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


def solve_program(
    blocks: Sequence[Block],
    start: FloatArray | Solution,
    bounds: tuple[FloatArray, FloatArray],
    options: dict[str, Any],
    *,
    reusable: bool = True,
) -> Solution:
    """Minimise the sum of the costs of all blocks under their constraints.

    Args:
        blocks: Blocks. Constraints are ordered by block, then by repetition.
        start: Initial variables, shape (size,), or an earlier solution.
        bounds: Lower and upper bounds of the variables, shape (size,) each.
        options: IPOPT options in addition to `IPOPT_OPTIONS`.
        reusable: Whether the same kernels, variables and options are likely to be used again.
    """
    blocks = [block for block in blocks if block.index.size]
    structure = tuple(
        (block.kernel, block.index.shape, np.ascontiguousarray(block.index).tobytes())
        for block in blocks
    )
    make = _solver if reusable else _solver.__wrapped__
    solver = make(len(bounds[0]), structure, tuple(options.items()))
    known = {}
    if isinstance(start, Solution):
        parts = np.split(start.multipliers, [len(bounds[0])])
        known = dict(zip(("lam_x0", "lam_g0"), parts, strict=True))
        start = start.x
    result = solver(
        x0=start,
        **known,
        lbx=bounds[0],
        ubx=bounds[1],
        p=np.concatenate([b.column(b.parameters, b.kernel.parameters) for b in blocks]),
        lbg=np.concatenate([b.column(b.low, b.kernel.constraints) for b in blocks]),
        ubg=np.concatenate([b.column(b.high, b.kernel.constraints) for b in blocks]),
    )
    stats = solver.stats()
    return Solution(
        np.array(result["x"]).ravel(),
        np.concatenate([np.array(result[name]).ravel() for name in ("lam_x", "lam_g")]),
        bool(stats["success"]),
        int(stats["iter_count"]),
    )


@lru_cache(maxsize=16)
def _solver(
    size: int,
    structure: tuple[tuple[Kernel, tuple[int, int], bytes], ...],
    options: tuple[tuple[str, Any], ...],
) -> Any:
    """IPOPT for blocks of kernels, shapes and contents of their indices."""
    import casadi as ca

    x, weight = ca.MX.sym("x", size), ca.MX.sym("w")
    p = ca.MX.sym("p", sum(kernel.parameters * times for kernel, (_, times), _ in structure))
    count = sum(kernel.constraints * times for kernel, (_, times), _ in structure)
    multipliers = ca.MX.sym("l", count)
    cost, gradient, hessian = ca.MX(0.0), ca.MX(size, 1), ca.MX(size, size)
    constraints, jacobians = [], []
    start, dual = 0, 0
    for kernel, (_, times), content in structure:
        # selects the variables of the kernel, repetition by repetition
        columns = np.frombuffer(content, dtype=np.intp).reshape(-1, times).T.ravel().tolist()
        rows = list(range(len(columns)))
        select = ca.DM.ones(ca.Sparsity.triplet(len(columns), size, rows, columns))
        z = ca.reshape(ca.mtimes(select, x), kernel.variables, times)
        q = ca.reshape(p[start : start + kernel.parameters * times], kernel.parameters, times)
        end = dual + kernel.constraints * times
        factors = ca.reshape(multipliers[dual:end], kernel.constraints, times)
        start, dual = start + q.numel(), end
        costs, g = kernel.value.map(times)(z, q)
        slope, jacobian = kernel.first.map(times)(z, q)
        curvature = kernel.second.map(times)(z, q, ca.repmat(weight, 1, times), factors)
        cost += ca.sum2(costs)
        gradient += ca.mtimes(select.T, ca.vec(slope))
        constraints.append(ca.vec(g))
        jacobians.append(ca.mtimes(_diagonal(jacobian, times), select))
        hessian += ca.mtimes(select.T, ca.mtimes(_diagonal(curvature, times), select))
    g, names = ca.vertcat(*constraints), ["x", "p"]
    derivatives = {
        "grad_f": ca.Function(
            "grad_f", [x, p], [cost, ca.densify(gradient)], names, ["f", "grad_f_x"]
        ),
        "jac_g": ca.Function("jac_g", [x, p], [g, ca.vertcat(*jacobians)], names, ["g", "jac_g_x"]),
        "hess_lag": ca.Function(
            "hess_lag",
            [x, p, weight, multipliers],
            [ca.triu(hessian)],
            [*names, "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        ),
    }
    problem = {"x": x, "p": p, "f": cost, "g": g}
    return ca.nlpsol("minimise", "ipopt", problem, derivatives | IPOPT_OPTIONS | dict(options))


def _diagonal(parts: Any, times: int) -> Any:
    """The block diagonal matrix of horizontally stacked parts, one for each repetition."""
    import casadi as ca

    if times == 1:
        return parts
    part = ca.DM.ones(ca.horzsplit(parts, parts.size2() // times)[0].sparsity())
    return ca.MX(ca.kron(ca.DM.eye(times), part).sparsity(), ca.vec(parts.nz[:]))
