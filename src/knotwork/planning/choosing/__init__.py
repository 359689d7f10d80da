"""Choice of the unknowns of a scenario: durations, speeds and knots, as numbers in its place."""

from knotwork.planning.choosing.choice import ChosenTimes, choose_times
from knotwork.planning.choosing.freezing import frozen_text, saved_text
from knotwork.planning.choosing.meeting import with_times_met
from knotwork.planning.choosing.task import with_optimal_knots

__all__ = [
    "ChosenTimes",
    "choose_times",
    "frozen_text",
    "saved_text",
    "with_optimal_knots",
    "with_times_met",
]
