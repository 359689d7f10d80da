"""Each step of the solver: progress reported, feasible motions kept, the budget observed."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from knotwork.arguments import finite_number
from knotwork.timing.motion import Progress
from knotwork.waypoints import FloatArray

SOONEST = 1e-9
"""The least budget of a part, where nothing is left [s]."""

OnStep = Callable[[FloatArray, float, FloatArray], bool]

PROMISING = 1e-2
"""A step is tried as a motion if it violates no scaled constraint by more than this."""


@dataclass(eq=False)
class Budget:
    """Time that there is for something, from when this is made.

    Raises:
        InputError: It is not positive.

    Attributes:
        seconds: How long [s], or `None` if it is not limited.
        now: The clock [s].
        begun: When it began, by this clock.
    """

    seconds: float | None = None
    now: Callable[[], float] = clock.perf_counter
    begun: float = field(init=False)

    def __post_init__(self) -> None:
        if self.seconds is not None:
            self.seconds = finite_number(self.seconds, "budget", "s", positive=True)
        self.begun = self.now()

    def end(self) -> float:
        """When it ends, by its clock; never without a limit."""
        return np.inf if self.seconds is None else self.begun + self.seconds

    def turn(self, part: float) -> float:
        """When a part of the time left ends, from 0 to 1."""
        now = self.now()
        return now + (self.end() - now) * part


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
    _time: Budget = field(init=False)
    _turn: float = field(init=False, default=np.inf)

    def __post_init__(self) -> None:
        self._time = Budget(self.budget, self.now)
        self.budget, self.begun = self._time.seconds, self._time.begun

    @property
    def needed(self) -> bool:
        """Whether anything depends on the steps of the solver."""
        return self.progress is not None or self.budget is not None

    def within(self, part: float, work: int = 1) -> Watch:
        """A watch for something that is tried, with a part of the budget left.

        Args:
            part: From 0 to 1.
            work: As of this watch.
        """
        if self.budget is None:
            return Watch(work=work, now=self.now)
        left = max(self._time.turn(part) - self.now(), SOONEST)
        return Watch(budget=left, work=work, now=self.now)

    @contextmanager
    def part(self, intervals: int) -> Iterator[None]:
        """Give a part its turn: the budget left, shared by the intervals left."""
        if self.budget is not None:
            self._turn = self._time.turn(intervals / max(self.work - self.solved, intervals))
        yield
        self.solved += intervals

    def late(self, *, found: bool, ahead: float = 0.0) -> bool:
        """Whether to stop: the budget has ended, or the turn has and a motion was found.

        Args:
            found: Whether there is a motion.
            ahead: What the next step is likely to take [s].
        """
        if self.budget is None:
            return False
        now = self.now() + ahead
        return now > self._time.end() or (found and now > self._turn)

    def step(self, objective: float, violation: float) -> None:
        """Count a step and report it."""
        self.iterations += 1
        if self.progress is not None:
            seconds, done = self.now() - self.begun, min(self.solved / self.work, 1.0)
            self.progress(Progress(self.iterations, seconds, objective, violation, done))


@dataclass(eq=False)
class Steps:
    """Steps of one run of the solver.

    Attributes:
        watch: Where they are reported.
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
        if self.watch.budget is not None and violation < PROMISING:
            tried = self.attempt(x)
            if tried is not None and (self.best is None or tried[0] < self.best[0]):
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
