"""Each step of the solver: progress told, feasible motions kept, the budget held."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from knotwork.timing.motion import Progress
from knotwork.waypoints import FloatArray

OnStep = Callable[[FloatArray, float, FloatArray], bool]

PROMISING = 1e-2
"""A step is tried as a motion if it violates no scaled constraint by more than this."""


@dataclass(eq=False)
class Watch:
    """Follows a solution over all its sections.

    Attributes:
        progress: Called at each step, or `None`.
        deadline: When the budget ends, by `perf_counter` [s]; infinite without a budget.
        begun: When the solution began.
        iterations: Steps so far.
        done: Part of the intervals that are solved.
        overdue: Whether the solver was stopped because the budget had ended.
    """

    progress: Callable[[Progress], None] | None = None
    deadline: float = np.inf
    begun: float = field(default_factory=clock.perf_counter)
    iterations: int = 0
    done: float = 0.0
    overdue: bool = False

    @property
    def needed(self) -> bool:
        """Whether anything depends on the steps of the solver."""
        return self.progress is not None or bool(np.isfinite(self.deadline))

    def late(self) -> bool:
        """Whether the budget has ended."""
        return clock.perf_counter() > self.deadline

    def step(self, objective: float, violation: float) -> None:
        """Count a step and tell of it."""
        self.iterations += 1
        if self.progress is not None:
            seconds = clock.perf_counter() - self.begun
            self.progress(Progress(self.iterations, seconds, objective, violation, self.done))


@dataclass(eq=False)
class Steps:
    """Steps of one run of the solver.

    Attributes:
        watch: What they are told to.
        low, high: Least and greatest values of the constraints.
        attempt: Makes a motion of the variables of a step and returns its cost and itself, or
            `None` if it is not feasible.
        best: The best motion so far, and its cost.
    """

    watch: Watch
    low: FloatArray
    high: FloatArray
    attempt: Callable[[FloatArray], tuple[float, Any] | None]
    best: tuple[float, Any] | None = None

    def __call__(self, x: FloatArray, objective: float, g: FloatArray) -> bool:
        """Look at a step; return whether the solver is to stop."""
        violation = float(np.maximum(self.low - g, g - self.high).max(initial=0.0))
        self.watch.step(objective, violation)
        if np.isfinite(self.watch.deadline) and violation < PROMISING:
            tried = self.attempt(x)
            if tried is not None and (self.best is None or tried[0] < self.best[0]):
                self.best = tried
        if not self.watch.late():
            return False
        self.watch.overdue = True
        return True


def casadi_callback(size: int, constraints: int, parameters: int, steps: OnStep) -> Any:
    """Make the object that CasADi calls at each step."""
    import casadi as ca

    sizes = {"x": size, "f": 1, "g": constraints, "lam_x": size, "lam_g": constraints}

    class EachStep(ca.Callback):
        def __init__(self) -> None:
            ca.Callback.__init__(self)
            self.construct("each_step", {})

        def get_n_in(self) -> int:
            return int(ca.nlpsol_n_out())

        def get_n_out(self) -> int:
            return 1

        def get_name_in(self, i: int) -> str:
            return str(ca.nlpsol_out(i))

        def get_name_out(self, i: int) -> str:
            return "ret"

        def get_sparsity_in(self, i: int) -> Any:
            name = ca.nlpsol_out(i)
            return ca.Sparsity.dense(parameters if name == "lam_p" else sizes[name], 1)

        def eval(self, arguments: Any) -> list[int]:
            x, f, g = arguments[:3]
            return [int(steps(np.array(x).ravel(), float(f), np.array(g).ravel()))]

    return EachStep()
