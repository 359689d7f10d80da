"""Compare planners on one task, by the figures that matter to it.

    python examples/compare_planners.py [SCENARIO]

What `knotwork compare` prints as a table, here as data: which planners meet every position and
speed without a jump of acceleration, and which of these has the least peak of jerk?
"""

import sys

import knotwork as kw


def main(scenario: str) -> None:
    """Rank the planners that do all that is asked."""
    comparison = kw.compare(scenario)
    smooth = [
        (score.peak_jerk.value, score)
        for score in comparison.scores
        if max(score.position_miss, score.velocity_miss, score.acceleration_jump) < 1e-9
        and score.peak_jerk is not None
    ]
    print(f"{len(smooth)} of {len(comparison.rows)} meet everything smoothly: {scenario}")
    print("peaks in rad or m, per second")
    for jerk, score in sorted(smooth, key=lambda pair: pair[0]):
        print(
            f"{score.planner:26} jerk {jerk:8.4f}"
            f"   acceleration {score.peak_acceleration.value:7.4f}"
            f"   velocity {score.peak_velocity.value:7.4f}"
        )


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "ur5_deburring")
