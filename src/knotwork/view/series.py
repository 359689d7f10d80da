"""One curve of a panel."""

from __future__ import annotations

from dataclasses import dataclass

from knotwork.view.motions import Motion


@dataclass(frozen=True)
class Series:
    """One joint of one motion in a panel, and how it is drawn.

    Attributes:
        motion: The motion.
        joint: Its joint.
        index: Which colour.
        dashed: Which line style.
        who: What tells it from others in the panel.
    """

    motion: Motion
    joint: str
    index: int
    dashed: int
    who: str

    @property
    def component(self) -> int:
        """Index of the joint in the motion."""
        return self.motion.joint_names.index(self.joint)

    @property
    def unit(self) -> str:
        """Unit of the joint, `"rad"` or `"m"`."""
        return self.motion.joint_units[self.component]
