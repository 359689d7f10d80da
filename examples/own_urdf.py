"""Plan for a robot of your own: all that is needed is its URDF.

    python examples/own_urdf.py

The URDF here is a planar arm of three joints, written in place; a path to a file of yours does as
well. Its limits are the URDF's; acceleration, which URDF can't say, is limited by the scenario.
"""

import tempfile
from pathlib import Path

import knotwork as kw


def link(name: str) -> str:
    """Write a link without mass or shape."""
    return f'<link name="{name}"/>'


def joint(name: str, parent: str, child: str, x: float, kind: str = "revolute") -> str:
    """Write a joint about z, a distance x [m] along its parent."""
    # rad, rad/s, N m
    limit = '<limit lower="-3.1" upper="3.1" velocity="2.5" effort="50"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{x} 0 0"/><axis xyz="0 0 1"/>{limit if kind == "revolute" else ""}</joint>'
    )


URDF = (
    '<robot name="three_links">'
    + "".join(link(name) for name in ("base", "upper", "lower", "hand", "tip"))
    + joint("shoulder", "base", "upper", 0.0)
    + joint("elbow", "upper", "lower", 0.5)
    + joint("wrist", "lower", "hand", 0.4)
    + joint("tip_mount", "hand", "tip", 0.1, kind="fixed")
    + "</robot>"
)


def pose(x: float, y: float) -> dict[str, list[float]]:
    """A place in the plane [m], the hand along x [rad]."""
    return {"position": [x, y, 0.0], "rpy": [0.0, 0.0, 0.0]}


def main() -> None:
    """Write a letter's stroke at constant speed."""
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "three_links.urdf"
        urdf.write_text(URDF, encoding="utf-8")
        plan = kw.plan(
            {
                "robot": str(urdf),
                "tool": {"frame": "tip"},
                "limits": {"acceleration": 8.0},  # rad/s²
                "waypoints": [  # s, m, m/s
                    {"pose": pose(0.6, -0.3)},
                    {"after": 1, "pose": pose(0.7, -0.1), "velocity": {"linear": [0, 0.3, 0]}},
                    {"after": 0.5, "pose": pose(0.7, 0.05), "velocity": {"linear": [0, 0.3, 0]}},
                    {"after": 1, "pose": pose(0.6, 0.25)},
                ],
            }
        )
    for found in plan.report.select(group="Joint limits"):
        if found.limit is not None and found.quantity in ("velocity", "acceleration"):
            numbers = f"{found.value:.3f} of {found.limit:.1f} {found.unit}"
            print(f"{found.name} {found.quantity}: {numbers}")
    print("all requirements met" if plan.report.ok else "FAILED")
    plan.report.raise_if_failed()


if __name__ == "__main__":
    main()
