"""Numbers for the unknown durations, speeds and knots of a scenario.

`choose_values` gives the `ChosenValues` of a `SolvedScenario`, in three steps:

1. `maximum_path_speeds` chooses the `PathSpeeds` along all tool paths, from a `PathSpeedProblem`
   for each of them.
2. `solve_sections` finds a `TimedMotion` for each `TimingSection` between paths and waits:
   `solve_with_budget` for its `TimingProblem`, or `plan_clear_section` with `way: clear`.
3. `with_chosen_values` writes the numbers into the task.

If poses are in moving frames, `fix_arrival_times` repeats this until their times agree.
"""

from knotwork.planning.choosing.chosen_values import ChosenValues, choose_values
from knotwork.planning.choosing.frozen_task import frozen_text, saved_text
from knotwork.planning.choosing.moving_frame_arrivals import fix_arrival_times
from knotwork.planning.choosing.solved_scenario import SolvedScenario

__all__ = [
    "ChosenValues",
    "SolvedScenario",
    "choose_values",
    "fix_arrival_times",
    "frozen_text",
    "saved_text",
]
