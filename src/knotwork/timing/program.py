"""Nonlinear programs made of few small functions, each repeated many times, solved by IPOPT.

A motion of a thousand intervals has the same equations in each. A `Kernel` holds them once, with
their derivatives; a `Program` maps it over columns of variables and assembles the sparse Jacobian
and Hessian by index. So it takes no longer to set up a long motion than a short one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.timing.budget import OnStep, casadi_callback
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
        z: Its variables, a symbolic column.
        p: Its parameters, a symbolic column.
        g: Its constraints, a symbolic column.
        cost: What it adds to the objective.
        inner: Symbols that stand in `g` and `cost` for expressions of the variables, and these
            expressions. By the chain rule, derivatives of long expressions in few inner symbols
            take a fraction of the operations.
    """

    def __init__(
        self, z: Any, p: Any, g: Any, cost: Any = 0.0, inner: tuple[Any, Any] | None = None
    ) -> None:
        import casadi as ca

        cost, g = ca.SX(cost), ca.densify(ca.SX(g))
        self.variables, self.parameters, self.constraints = z.numel(), p.numel(), g.numel()
        self.costs = not cost.is_zero()
        multipliers, weight = ca.SX.sym("l", self.constraints), ca.SX.sym("w")
        symbols, meant = inner or (ca.SX(0, 1), ca.SX(0, 1))
        both = ca.vertcat(z, symbols)
        change = ca.vertcat(ca.SX.eye(self.variables), ca.jacobian(meant, z))
        bent, slope = ca.hessian(weight * cost + ca.dot(multipliers, g), both)
        pull = ca.SX.sym("pull", symbols.numel())
        turned = ca.substitute(
            ca.hessian(ca.dot(pull, meant), z)[0], pull, slope[self.variables :, :]
        )
        jacobian, gradient, hessian = (
            ca.mtimes(ca.jacobian(g, both), change),
            ca.mtimes(ca.gradient(cost, both).T, change).T,
            ca.triu(ca.mtimes(change.T, ca.mtimes(bent, change)) + turned),
        )
        if inner is not None:
            at = ca.Function(
                "at", [both, p, weight, multipliers], [cost, g, jacobian, gradient, hessian]
            )
            known = ca.vertcat(z, meant), p, weight, multipliers
            cost, g, jacobian, gradient, hessian = at(*known)
        self.jacobian_at = _entries(jacobian)
        self.hessian_at = _entries(hessian)
        self.value = ca.Function("value", [z, p], [ca.densify(cost), g])
        self.first = ca.Function("first", [z, p], [ca.densify(gradient), _nonzeros(jacobian)])
        self.second = ca.Function("second", [z, p, weight, multipliers], [_nonzeros(hessian)])


def _entries(matrix: Any) -> tuple[IndexArray, IndexArray]:
    rows, columns = matrix.sparsity().get_triplet()
    return np.array(rows, dtype=np.intp), np.array(columns, dtype=np.intp)


def _nonzeros(matrix: Any) -> Any:
    import casadi as ca

    return ca.vertcat(*matrix.nonzeros()) if matrix.nnz() else ca.SX(0, 1)


@dataclass(frozen=True, eq=False)
class Block:
    """A kernel, and the variables it is applied to.

    Attributes:
        kernel: The kernel.
        index: Which variables of the program are its variables, a column for each time that it is
            repeated; shape (variables, times).
    """

    kernel: Kernel
    index: IndexArray

    @property
    def times(self) -> int:
        """How often the kernel is repeated."""
        return int(self.index.shape[1])


@dataclass(frozen=True, eq=False)
class Solution:
    """What the solver gave back.

    Attributes:
        x: Variables.
        multipliers: Of the bounds of the variables and of the constraints, one after the other.
        objective: Its value.
        status: As IPOPT calls it.
        solved: Whether IPOPT converged.
        iterations: Its steps.
    """

    x: FloatArray
    multipliers: FloatArray
    objective: float
    status: str
    solved: bool
    iterations: int


class Program:
    """Minimise the sum of the costs of all blocks under their constraints.

    Args:
        size: Number of variables.
        blocks: Its blocks. Constraints are numbered block by block, and in a block repetition by
            repetition.
        steps: Called at every step with the variables, the objective and the constraints; if it
            returns true the solver stops.
        options: Options of IPOPT besides `OPTIONS`.
    """

    def __init__(
        self,
        size: int,
        blocks: Sequence[Block],
        *,
        steps: OnStep | None = None,
        options: dict[str, Any] | None = None,
    ) -> None:
        self.size, self.blocks = size, tuple(b for b in blocks if b.times)
        self.constraints = sum(b.kernel.constraints * b.times for b in self.blocks)
        self._set_up(steps, OPTIONS | (options or {}))

    def _set_up(self, steps: OnStep | None, options: dict[str, Any]) -> None:
        import casadi as ca

        x = ca.MX.sym("x", self.size)
        sizes = [b.kernel.parameters * b.times for b in self.blocks]
        p = ca.MX.sym("p", sum(sizes))
        given = ca.vertsplit(p, np.cumsum([0, *sizes]).tolist())
        columns = [
            (_gather(x, b.index), ca.reshape(q, b.kernel.parameters, b.times))
            for b, q in zip(self.blocks, given, strict=True)
        ]
        cost, g = self._values(columns)
        gradient, jacobian = self._first(columns)
        weight, multipliers = ca.MX.sym("w"), ca.MX.sym("l", self.constraints)
        hessian = self._second(columns, weight, multipliers)
        derivatives = {
            "grad_f": ca.Function(
                "grad_f", [x, p], [cost, gradient], ["x", "p"], ["f", "grad_f_x"]
            ),
            "jac_g": ca.Function("jac_g", [x, p], [g, jacobian], ["x", "p"], ["g", "jac_g_x"]),
            "hess_lag": ca.Function(
                "hess_lag",
                [x, p, weight, multipliers],
                [hessian],
                ["x", "p", "lam_f", "lam_g"],
                ["triu_hess_gamma_x_x"],
            ),
        }
        if steps is not None:
            self._callback = casadi_callback(self.size, self.constraints, p.numel(), steps)
            options = options | {"iteration_callback": self._callback}
        self._solver = ca.nlpsol(
            "least", "ipopt", {"x": x, "p": p, "f": cost, "g": g}, derivatives | options
        )

    def _values(self, columns: Any) -> tuple[Any, Any]:
        import casadi as ca

        costs, constraints = [], []
        for block, (z, p) in zip(self.blocks, columns, strict=True):
            cost, g = _mapped(block.kernel.value, block.times)(z, p)
            if block.kernel.costs:
                costs.append(ca.sum2(cost))
            constraints.append(ca.vec(g))
        return sum(costs[1:], costs[0]), ca.vertcat(*constraints)

    def _first(self, columns: Any) -> tuple[Any, Any]:
        import casadi as ca

        gradients, values, rows, positions = [], [], [], []
        first_row = 0
        for block, (z, p) in zip(self.blocks, columns, strict=True):
            kernel = block.kernel
            gradient, nonzeros = _mapped(kernel.first, block.times)(z, p)
            if kernel.costs:
                gradients.append((ca.vec(gradient), block.index.T.ravel()))
            row, column = kernel.jacobian_at
            starts = first_row + kernel.constraints * np.arange(block.times)[:, None]
            rows.append((starts + row).ravel())
            positions.append(block.index[column].T.ravel())
            values.append(ca.vec(nonzeros))
            first_row += kernel.constraints * block.times
        total = _summed(
            self.size,
            1,
            np.concatenate([index for _, index in gradients]),
            np.zeros(sum(index.size for _, index in gradients), dtype=np.intp),
            ca.vertcat(*(value for value, _ in gradients)),
        )
        jacobian = _summed(
            self.constraints,
            self.size,
            np.concatenate(rows),
            np.concatenate(positions),
            ca.vertcat(*values),
        )
        return ca.densify(total), jacobian

    def _second(self, columns: Any, weight: Any, multipliers: Any) -> Any:
        import casadi as ca

        values, rows, positions = [], [], []
        sizes = [b.kernel.constraints * b.times for b in self.blocks]
        parts = ca.vertsplit(multipliers, np.cumsum([0, *sizes]).tolist())
        for block, (z, p), part in zip(self.blocks, columns, parts, strict=True):
            kernel = block.kernel
            shaped = ca.reshape(part, kernel.constraints, block.times)
            weights = ca.repmat(weight, 1, block.times)
            nonzeros = _mapped(kernel.second, block.times)(z, p, weights, shaped)
            row, column = kernel.hessian_at
            one, other = block.index[row].T.ravel(), block.index[column].T.ravel()
            rows.append(np.minimum(one, other))
            positions.append(np.maximum(one, other))
            values.append(ca.vec(nonzeros))
        return _summed(
            self.size,
            self.size,
            np.concatenate(rows),
            np.concatenate(positions),
            ca.vertcat(*values),
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
            start: Variables to start from, shape (size,), or a solution that was found before.
            bounds: Least and greatest values of the variables.
            parameters: Of each block, shape (parameters, times).
            limits: Least and greatest values of each block's constraints, shape
                (constraints, times) each.
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
            float(found["f"]),
            str(stats["return_status"]),
            bool(stats["success"]),
            int(stats["iter_count"]),
        )


def joined_limits(limits: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Least and greatest values of all constraints, in the program's order."""
    low, high = zip(*limits, strict=True)
    return (
        np.concatenate([np.ravel(one, order="F") for one in low]),
        np.concatenate([np.ravel(one, order="F") for one in high]),
    )


def _mapped(function: Any, times: int) -> Any:
    return function.map(times) if times > 1 else function


def _gather(x: Any, index: IndexArray) -> Any:
    import casadi as ca

    return ca.reshape(x[index.T.ravel().tolist()], *index.shape)


def _summed(rows: int, columns: int, row: IndexArray, column: IndexArray, values: Any) -> Any:
    """Make a sparse matrix of entries, those at the same place added up."""
    import casadi as ca

    place = column * rows + row
    order = np.argsort(place, kind="stable")
    first = np.concatenate(([True], np.diff(place[order]) > 0)) if order.size else order == 0
    target = np.cumsum(first) - 1
    unique = order[first]
    sparsity = ca.Sparsity.triplet(rows, columns, row[unique].tolist(), column[unique].tolist())
    if first.all():
        gathered = values[order.tolist()]
    else:
        adding = ca.DM(
            ca.Sparsity.triplet(len(unique), order.size, target.tolist(), order.tolist()),
            np.ones(order.size),
        )
        gathered = ca.mtimes(adding, values)
    return ca.MX(sparsity, gathered)
