"""The choice of one solution at each waypoint of a sequence."""

from knotwork.kinematics.sequence.alternatives import AlternativeSequence, find_alternatives
from knotwork.kinematics.sequence.candidates import Candidates, find_candidates
from knotwork.kinematics.sequence.choice import Sequence, choose_sequence
from knotwork.kinematics.sequence.costs import CollidingStep, Cost, Layer, Rules
from knotwork.kinematics.sequence.lazy_choice import choose_with_intervals
from knotwork.kinematics.sequence.nearness import interval_nearness, weights
from knotwork.kinematics.sequence.null_space_refinement import Given, refine_sequence

__all__ = [
    "AlternativeSequence",
    "Candidates",
    "CollidingStep",
    "Cost",
    "Given",
    "Layer",
    "Rules",
    "Sequence",
    "choose_sequence",
    "choose_with_intervals",
    "find_alternatives",
    "find_candidates",
    "interval_nearness",
    "refine_sequence",
    "weights",
]
