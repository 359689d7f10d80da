"""Numbers for the free durations, speeds and knots of a scenario."""

from knotwork.planning.choosing.chosen_times import ChosenValues, choose_times
from knotwork.planning.choosing.chosen_values import frozen_text, saved_text
from knotwork.planning.choosing.moving_frame_arrivals import fix_arrival_times

__all__ = ["ChosenValues", "choose_times", "fix_arrival_times", "frozen_text", "saved_text"]
