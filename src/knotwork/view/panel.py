"""A panel of a picture: which curves it shows, in which unit and range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knotwork.joint_quantities import DERIVATIVES, rate_unit
from knotwork.units import Units
from knotwork.view.drawn_motions import Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Series:
    """One joint of one motion in a panel, and how it is drawn.

    Attributes:
        motion: The motion.
        joint: Its joint.
        index: Which colour and line style.
        who: Its name in the panel, empty if it is alone.
    """

    motion: Motion
    joint: str
    index: int
    who: str

    @property
    def component(self) -> int:
        """Index of the joint in the motion."""
        return self.motion.trajectory.joint_names.index(self.joint)


@dataclass
class Panel:
    """A panel and its curves; drawing them finds the range of values.

    Attributes:
        axis: Where.
        quantity: Name of the quantity.
        series: The curves, all of joints of one unit.
        units: Those that values are shown in.
        low, high: Range of values to show.
    """

    axis: Axes
    quantity: str
    series: list[Series]
    units: Units
    low: float = np.inf
    high: float = -np.inf

    @property
    def order(self) -> int:
        """Order of the derivative."""
        return DERIVATIVES.index(self.quantity)

    @property
    def _shown(self) -> tuple[float, str]:
        first = self.series[0]
        own = first.motion.trajectory.joint_units[first.component]
        return self.units.shown(1.0, rate_unit(own, self.order))

    @property
    def factor(self) -> float:
        """From the SI unit to the shown one."""
        return self._shown[0]

    @property
    def unit(self) -> str:
        """Unit that values are shown in."""
        return self._shown[1]

    @property
    def percent(self) -> bool:
        """Whether values are parts of each joint's own limits: joints share the panel, all limited.

        A position is in parts of half its range, from the middle of it.
        """
        bounds = [one.motion.bounds(one.joint, self.quantity) for one in self.series]
        return not self.one_joint and bool(np.isfinite(bounds).all())

    @property
    def shown_in(self) -> str:
        """The unit at the panel's axis."""
        if self.percent:
            return "% of range" if self.quantity == "position" else "% of limit"
        return self.unit

    def scale(self, one: Series) -> tuple[float, float]:
        """Factor and offset from a curve's values to those shown."""
        if not self.percent:
            return self.factor, 0.0
        lower, upper = one.motion.bounds(one.joint, self.quantity)
        factor = 200.0 / max(upper - lower, 1e-12)
        return factor, -0.5 * factor * (lower + upper)

    @property
    def alone(self) -> bool:
        """Whether one joint of one motion is shown, with its details."""
        return len(self.series) == 1

    @property
    def one_joint(self) -> bool:
        """Whether all curves are of the same joint."""
        return len({one.joint for one in self.series}) == 1

    def gid(self, kind: str, one: Series) -> str:
        """Name of something drawn for a curve, for those who look for it in the figure."""
        return f"{kind}:{one.motion.label}:{one.joint}:{self.quantity}"
