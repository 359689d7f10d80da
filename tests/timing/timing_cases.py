"""Random problems for the tests of minimum times, and the contract that every motion keeps."""

from __future__ import annotations

import numpy as np

from knotwork.joint_quantities import JointLimits
from knotwork.planning.timing import TimedMotion, TimingProblem


def random_problem(seed: int, n: int, d: int) -> TimingProblem:
    """Uneven moves and limits; velocities at inner waypoints of any direction."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-1.5, 0.3, (n, 1))
    position = np.cumsum(rng.uniform(-1.0, 1.0, (n, d)) * size, axis=0)
    V, A = rng.uniform(1.0, 4.0, d), rng.uniform(3.0, 20.0, d)
    velocity = np.zeros((n, d))
    velocity[1:-1] = rng.uniform(-0.3, 0.3, (n - 2, d)) * V
    limits = JointLimits(V, A, A * rng.uniform(5.0, 100.0, d))
    return TimingProblem(tuple(f"joint {k}" for k in range(d)), position, velocity, limits)


def assert_kept(problem: TimingProblem, motion: TimedMotion) -> None:
    """The whole contract, by the exact extrema and by the polynomials themselves."""
    curve, limits = motion.trajectory, problem.limits
    known = problem.velocity_known
    scale = np.maximum(1.0, np.abs(problem.position).max())
    assert np.abs(curve.position(motion.time) - problem.position).max() <= 1e-13 * scale
    np.testing.assert_allclose(curve.velocity(motion.time), motion.velocity, rtol=0, atol=1e-12)
    assert (motion.velocity[known] == problem.velocity[known]).all()
    for name in ("velocity", "acceleration", "jerk"):
        assert (curve.extrema(name).peak <= getattr(limits, name) * (1 + 1e-10)).all(), name
    found = curve.extrema("position")
    assert (found.minimum >= limits.lower - 1e-10).all()
    assert (found.maximum <= limits.upper + 1e-10).all()
    for order in range(3):
        jumps = np.abs(curve.polynomial.jumps(order)).max(initial=0.0)
        assert jumps <= 1e-12 * curve.extrema(order).peak.max(), order
    h = np.diff(motion.time)
    given = ~problem.duration_is_unknown
    np.testing.assert_allclose(h[given], problem.duration[given], rtol=1e-12)
    assert (h >= problem.min_duration * (1 - 1e-12)).all()
    assert motion.lower_bound <= motion.duration * (1 + 1e-12)
    assert motion.status == "optimal"
