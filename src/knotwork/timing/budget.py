"""Each step of the solver: progress reported, feasible motions kept, the budget observed."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from knotwork.errors.arguments import finite_number
from knotwork.timing.motion import Progress
from knotwork.waypoints import FloatArray

OnStep = Callable[[FloatArray, float, FloatArray], bool]

PROMISING = 1e-2
"""A step is tried as a motion if it violates no scaled constraint by more than this."""


@dataclass(eq=False)
class Watch:
    """Follows a solution over all its parts, and shares the budget among them.

    A part whose turn is over stops as soon as it has a motion; without one it goes on until the
    whole budget has ended.

    Raises:
        InputError: The budget is not positive.

    Attributes:
        progress: Called at each step, or `None`.
        budget: Time that there is for all parts [s], or `None`.
        work: Intervals of all parts together.
        now: The clock [s].
        begun: When the solution began, by this clock.
        iterations: Steps so far.
        solved: Intervals of the parts that are solved.
    """

    progress: Callable[[Progress], None] | None = None
    budget: float | None = None
    work: int = 1
    now: Callable[[], float] = clock.perf_counter
    iterations: int = 0
    solved: int = 0
    begun: float = field(init=False)
    _turn: float = field(init=False, default=np.inf)

    def __post_init__(self) -> None:
        if self.budget is not None:
            self.budget = finite_number(self.budget, "budget", "s", positive=True)
        self.begun = self.now()

    @property
    def needed(self) -> bool:
        """Whether anything depends on the steps of the solver."""
        return self.progress is not None or self.budget is not None

    def left(self) -> float:
        """Time left [s]; infinite without a budget."""
        return np.inf if self.budget is None else self.begun + self.budget - self.now()

    @contextmanager
    def part(self, intervals: int) -> Iterator[None]:
        """Give a part its turn: the budget left, shared by the intervals left."""
        before = self._turn
        if self.budget is not None:
            self._turn = self.now() + self.left() * intervals / max(
                self.work - self.solved, intervals
            )
        yield
        self._turn = before
        self.solved += intervals

    def late(self, *, found: bool) -> bool:
        """Whether to stop: the budget has ended, or the turn has and a motion was found.

        Args:
            found: Whether there is a motion.
        """
        if self.budget is None:
            return False
        now = self.now()
        return now > self.begun + self.budget or (found and now > self._turn)

    def step(
        self,
        objective: float,
        violation: float,
        duration: float | None = None,
        trying: str = "",
        part: float = 0.0,
    ) -> None:
        """Count a step and report it; arguments as the attributes of `Progress`.

        `part` is done of the interval at hand, from 0 to 1.
        """
        self.iterations += 1
        if self.progress is not None:
            seconds, done = self.now() - self.begun, min((self.solved + part) / self.work, 1.0)
            self.progress(
                Progress(self.iterations, seconds, objective, violation, done, duration, trying)
            )


@dataclass(eq=False)
class Steps:
    """Steps of one run of the solver.

    Attributes:
        watch: Where they are reported.
        low, high: Least and greatest values of the constraints.
        attempt: Makes a motion with a `cost` of the variables of a step; `None` if it is not
            feasible.
        best: The best motion so far.
    """

    watch: Watch
    low: FloatArray
    high: FloatArray
    attempt: Callable[[FloatArray], Any]
    best: Any = None

    def __call__(self, x: FloatArray, objective: float, g: FloatArray) -> bool:
        """Look at a step; return whether the solver is to stop."""
        violation = float(np.maximum(self.low - g, g - self.high).max(initial=0.0))
        self.watch.step(objective, violation)
        if self.watch.budget is not None and violation < PROMISING:
            tried = self.attempt(x)
            if tried is not None and (self.best is None or tried.cost < self.best.cost):
                self.best = tried
        return self.watch.late(found=self.best is not None)


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

        def get_sparsity_in(self, i: int) -> Any:
            return ca.Sparsity.dense(sizes.get(ca.nlpsol_out(i), parameters), 1)

        def eval(self, arguments: Any) -> list[int]:
            x, f, g = arguments[:3]
            return [int(steps(np.array(x).ravel(), float(f), np.array(g).ravel()))]

    return EachStep()
