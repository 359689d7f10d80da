"""Numbers for the free durations, speeds and knots of a scenario."""

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
