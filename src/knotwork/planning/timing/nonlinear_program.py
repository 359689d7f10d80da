"""Nonlinear programs of a few small functions, each repeated many times, solved by IPOPT.

All intervals of a motion have the same equations. A `Kernel` has these equations once, with their
derivatives. `solve_program` maps it over columns of variables and assembles the sparse Jacobian and
Hessian by index. Thus the setup time does not depend on the length of the motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
        variables: A symbolic column.
        parameters: Symbolic columns by name.
        constraints: Symbolic columns by name.
        cost: Term of the objective.
        inner: Symbols that stand for functions of the variables in the constraints and the cost,
            and these functions. With a few such symbols, the chain rule needs only a fraction of
            the operations.

    Attributes:
        variable_count, parameter_count, constraint_count: Total numbers of rows.
        parameter_rows, constraint_rows: Number of rows of each, by name.
        value: Function of variables and parameters: cost and constraints.
        first: Function of these: first derivatives of cost and constraints.
        second: Function of these and of weights: second derivative of the Lagrange function.
    """

    def __init__(
        self,
        variables: Any,
        parameters: Mapping[str, Any],
        constraints: Mapping[str, Any],
        cost: Any = 0.0,
        inner: tuple[Any, Any] | None = None,
    ) -> None:
        import casadi as ca

        empty, z = ca.SX(0, 1), variables
        p = ca.vertcat(empty, *parameters.values())
        g = ca.densify(ca.vertcat(empty, *constraints.values()))
        cost = ca.densify(ca.SX(cost))
        self.variable_count = z.numel()
        self.parameter_count = p.numel()
        self.constraint_count = g.numel()
        self.parameter_rows = {name: column.numel() for name, column in parameters.items()}
        self.constraint_rows = {name: column.numel() for name, column in constraints.items()}
        multipliers, weight = ca.SX.sym("multipliers", g.numel()), ca.SX.sym("weight")
        inner_symbols, inner_values = inner or (empty, empty)
        symbolic = ca.vertcat(z, inner_symbols)
        change = ca.vertcat(ca.SX.eye(self.variable_count), ca.jacobian(inner_values, z))
        curvature, slope = ca.hessian(weight * cost + ca.dot(multipliers, g), symbolic)
        pull = ca.SX.sym("pull", inner_symbols.numel())
        inner_curvature = ca.substitute(
            ca.hessian(ca.dot(pull, inner_values), z)[0], pull, slope[self.variable_count :, :]
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
        parameters: Values of its parameters by name, which broadcast to shape (rows, times); others
            are ignored.
        bounds: Lower and upper bounds of its constraints by name, of the same shapes. A constraint
            without bounds must be 0.
    """

    kernel: Kernel
    index: IndexArray
    parameters: Mapping[str, Any] = field(default_factory=dict)
    bounds: Mapping[str, tuple[Any, Any]] = field(default_factory=dict)

    @property
    def parameter_values(self) -> FloatArray:
        """Parameters of all repetitions, one repetition after the other."""
        return self._column(self.kernel.parameter_rows, self.parameters)

    def bound_values(self, side: int) -> FloatArray:
        """Lower (0) or upper (1) bounds of all repetitions, one repetition after the other."""
        names = self.kernel.constraint_rows
        bounds = {name: self.bounds.get(name, (0.0, 0.0))[side] for name in names}
        return self._column(names, bounds)

    def _column(self, rows: Mapping[str, int], values: Mapping[str, Any]) -> FloatArray:
        times = self.index.shape[1]
        tables = [np.broadcast_to(values[name], (count, times)) for name, count in rows.items()]
        return np.ravel(np.concatenate([np.zeros((0, times)), *tables]), order="F")


def symbols(**rows: int) -> dict[str, Any]:
    """Symbolic columns by name, with their numbers of rows."""
    import casadi as ca

    return {name: ca.SX.sym(name, count) for name, count in rows.items()}


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
        p=np.concatenate([block.parameter_values for block in blocks]),
        lbg=np.concatenate([block.bound_values(0) for block in blocks]),
        ubg=np.concatenate([block.bound_values(1) for block in blocks]),
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
    repeated = [(kernel, times) for kernel, (_, times), _ in structure]
    p, p_of_blocks = _by_block("p", [k.parameter_count * times for k, times in repeated])
    multipliers, multipliers_of_blocks = _by_block(
        "multipliers", [k.constraint_count * times for k, times in repeated]
    )
    cost, gradient, hessian = ca.MX(0.0), ca.MX(size, 1), ca.MX(size, size)
    constraints, jacobians = [], []
    for (kernel, (_, times), content), p_of_block, multipliers_of_block in zip(
        structure, p_of_blocks, multipliers_of_blocks, strict=True
    ):
        # selects the variables of the kernel, repetition by repetition
        columns = np.frombuffer(content, dtype=np.intp).reshape(-1, times).T.ravel().tolist()
        rows = list(range(len(columns)))
        select = ca.DM.ones(ca.Sparsity.triplet(len(columns), size, rows, columns))
        z = ca.reshape(ca.mtimes(select, x), kernel.variable_count, times)
        values = ca.reshape(p_of_block, kernel.parameter_count, times)
        factors = ca.reshape(multipliers_of_block, kernel.constraint_count, times)
        costs, g = kernel.value.map(times)(z, values)
        slope, jacobian = kernel.first.map(times)(z, values)
        curvature = kernel.second.map(times)(z, values, ca.repmat(weight, 1, times), factors)
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


def _by_block(name: str, sizes: Sequence[int]) -> tuple[Any, Any]:
    """A symbolic column, and its range for each block."""
    import casadi as ca

    column = ca.MX.sym(name, sum(sizes))
    return column, ca.vertsplit(column, np.cumsum([0, *sizes]).tolist())


def _diagonal(parts: Any, times: int) -> Any:
    """The block diagonal matrix of horizontally stacked parts, one for each repetition."""
    import casadi as ca

    if times == 1:
        return parts
    part = ca.DM.ones(ca.horzsplit(parts, parts.size2() // times)[0].sparsity())
    return ca.MX(ca.kron(ca.DM.eye(times), part).sparsity(), ca.vec(parts.nz[:]))
