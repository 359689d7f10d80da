"""Use the spline without a robot: any numbers over time, with their rates.

    python examples/spline_alone.py

The curve has the interface of SciPy's CubicHermiteSpline, which meets the same values and rates,
but whose second derivative jumps. Neither Pinocchio nor SciPy is loaded.
"""

import sys

import numpy as np

import knotwork as kw

TIME = np.array([0.0, 5.0, 15.0, 25.0])  # s
ANGLE = np.array([0.0, 30.0, 90.0, 180.0])  # deg
RATE = np.array([0.0, 8.0, 8.0, 0.0])  # deg/s


def main() -> None:
    """Build the curve, evaluate it, and show that it keeps what it promises."""
    values = np.column_stack((ANGLE, -ANGLE))  # two joints, a column each
    rates = np.column_stack((RATE, -RATE))
    spline = kw.ModifiedHermiteSpline(TIME, values, rates)

    assert np.allclose(spline(TIME), values)
    assert np.allclose(spline(TIME, 1), rates)
    print("knots [s]:", np.round(spline.x, 2))
    for order, unit in enumerate(("deg", "deg/s", "deg/s²")):
        print(f"at 7.5 s: {spline(7.5, order)[0]:.3f} {unit}")

    # The same waypoints as a motion of named joints, which any of the planners can make.
    waypoints = kw.JointWaypoints(("pan", "tilt"), TIME, np.radians(values), np.radians(rates))
    for name in ("modified-hermite", "cubic", "quintic:estimated"):
        trajectory = kw.interpolation.get_planner(name)(waypoints)
        jump = trajectory.continuity.acceleration.jump
        peak = trajectory.extrema("acceleration").peak.max()
        print(f"{name:18} acceleration: peak {peak:.4f} rad/s², largest jump {jump:.4f} rad/s²")

    print("Pinocchio loaded:", "pinocchio" in sys.modules)
    print("SciPy loaded:", "scipy" in sys.modules)


if __name__ == "__main__":
    main()
