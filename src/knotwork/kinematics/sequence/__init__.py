"""The choice of one solution at each waypoint of a sequence."""

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.kinematics.sequence.alternatives import AlternativeSequence as AlternativeSequence
    from knotwork.kinematics.sequence.alternatives import find_alternatives as find_alternatives
    from knotwork.kinematics.sequence.candidates import Candidates as Candidates
    from knotwork.kinematics.sequence.candidates import find_candidates as find_candidates
    from knotwork.kinematics.sequence.choice import Sequence as Sequence
    from knotwork.kinematics.sequence.choice import choose_sequence as choose_sequence
    from knotwork.kinematics.sequence.costs import CollidingStep as CollidingStep
    from knotwork.kinematics.sequence.costs import Cost as Cost
    from knotwork.kinematics.sequence.costs import Layer as Layer
    from knotwork.kinematics.sequence.costs import Rules as Rules
    from knotwork.kinematics.sequence.lazy_choice import (
        choose_with_intervals as choose_with_intervals,
    )
    from knotwork.kinematics.sequence.nearness import interval_nearness as interval_nearness
    from knotwork.kinematics.sequence.nearness import weights as weights
    from knotwork.kinematics.sequence.null_space_refinement import Given as Given
    from knotwork.kinematics.sequence.null_space_refinement import (
        refine_sequence as refine_sequence,
    )

__getattr__, __dir__, __all__ = lazy_names(__name__)
