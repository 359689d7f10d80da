"""The options of planners, and the type of a planner."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from knotwork.errors import OptionError, did_you_mean
from knotwork.interpolation.hermite import EndAcceleration
from knotwork.interpolation.knots import BalancedKnots
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import ChosenRun, FloatArray, JointWaypoints

ACCELERATION_RULES = ("zero", "estimated")
"""Names that `PlannerOptions.accelerations` accepts."""

CONTEXT = ("velocity_limit", "acceleration_limit")
"""Options that state limits of the joints rather than a wish: every planner accepts them."""


@dataclass(frozen=True, eq=False)
class PlannerOptions:
    """Options of the planners; one that a planner does not support is an error.

    Each planner's `PlannerSpec` names the options that it supports. Every planner accepts the
    limits; only some shape their motion by them. Arrays are kept
    read-only, `knots` and `end_acceleration` as tuples; options can be compared.

    >>> options = kw.interpolation.PlannerOptions(knots="balanced", end_acceleration="zero")
    >>> options.requested
    ('knots', 'end_acceleration')

    Attributes:
        knots: Where the rebuilt knots sit: `"paper"` for Eq. (39), `"balanced"`, a
            `BalancedKnots`, or the knot times [s] themselves.
        end_acceleration: `None` to leave the first and last acceleration to the planner,
            `"zero"`, or a pair (start, end) of scalars or arrays of shape (d,)
            [rad/s² or m/s²].
        accelerations: Accelerations at the waypoints: `None` for the planner's default,
            `"zero"`, `"estimated"` from the neighbouring waypoints, or an array of shape (n, d)
            [rad/s² or m/s²].
        jerks: Jerks at the waypoints, shape (n, d) [rad/s³ or m/s³]; `None` for zero.
        snaps: Fourth derivatives at the waypoints, shape (n, d) [rad/s⁴ or m/s⁴]; `None` for
            zero.
        transition_time: Durations of the transitions at the waypoints [s], a scalar or shape
            (n,); `None` to leave them to the planner.
        chosen: Segments whose motion was chosen beforehand, in order of time, or `None`.
        velocity_limit: Largest speed of each joint [rad/s or m/s], shape (d,), infinite where
            there is none.
        acceleration_limit: Largest magnitude of acceleration of each joint [rad/s² or m/s²],
            shape (d,), infinite where there is none.

    Raises:
        OptionError: `accelerations` is no name that is accepted, or a value is no number, not
            finite, or not positive where it must be.
    """

    knots: str | BalancedKnots | ArrayLike = "paper"
    end_acceleration: EndAcceleration = None
    accelerations: str | ArrayLike | None = None
    jerks: ArrayLike | None = None
    snaps: ArrayLike | None = None
    transition_time: float | ArrayLike | None = None
    chosen: tuple[ChosenRun, ...] | None = None
    velocity_limit: ArrayLike | None = None
    acceleration_limit: ArrayLike | None = None

    def __post_init__(self) -> None:
        def put(field: str, value: Any) -> None:
            object.__setattr__(self, field, value)

        put("knots", _as_tuples(self.knots))
        put("end_acceleration", _as_tuples(self.end_acceleration))
        if isinstance(self.accelerations, str):
            if self.accelerations not in ACCELERATION_RULES:
                raise OptionError(
                    "accelerations",
                    f"is {self.accelerations!r}; "
                    + did_you_mean(self.accelerations, (*ACCELERATION_RULES, "an array")),
                )
        else:
            put("accelerations", _numbers("accelerations", self.accelerations))
        for field in ("jerks", "snaps"):
            put(field, _numbers(field, getattr(self, field)))
        put("transition_time", _numbers("transition_time", self.transition_time, positive=True))
        for field in CONTEXT:
            put(field, _numbers(field, getattr(self, field), positive=True, infinite=True))

    @property
    def requested(self) -> tuple[str, ...]:
        """Names of the options that ask for something else than the default."""
        return tuple(
            field.name
            for field in fields(self)
            if field.name not in CONTEXT
            and _key(getattr(self, field.name)) != _key(getattr(type(self), field.name))
        )

    def _keys(self) -> tuple[Any, ...]:
        return tuple(_key(getattr(self, field.name)) for field in fields(self))

    def __eq__(self, other: object) -> bool:
        return self._keys() == other._keys() if isinstance(other, PlannerOptions) else False

    def __hash__(self) -> int:
        return hash(self._keys())


def _as_tuples(value: Any) -> Any:
    """Turn arrays and lists into tuples, however nested; leave everything else as it is."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return tuple(_as_tuples(entry) for entry in value)
    return value


def _key(value: Any) -> Any:
    """The key that a value is compared by."""
    if isinstance(value, np.ndarray):
        # adding 0.0 turns -0.0 into 0.0
        return value.shape, (value + 0.0).tobytes()
    return value


def _numbers(what: str, given: Any, *, positive: bool = False, infinite: bool = False) -> Any:
    """Copy numbers into a read-only array; `None` stays `None`.

    Raises:
        OptionError: They are no real numbers, not finite, or not positive where they must be.
    """
    if given is None:
        return None
    try:
        array = np.array(given)
    except ValueError as error:
        raise OptionError(what, f"is {given!r}; its rows differ in length") from error
    if array.dtype.kind not in "iuf":
        raise OptionError(what, f"is {given!r}; it must be real numbers")
    array = array.astype(float)
    bad = np.isnan(array) if infinite else ~np.isfinite(array)
    if positive:
        bad |= array <= 0.0
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        accepted = " and ".join(["positive"] * positive + (["not NaN"] if infinite else ["finite"]))
        place = f"at {list(index)} " if index else ""
        raise OptionError(what, f"{place}is {array[index]}; it must be {accepted}")
    array.setflags(write=False)
    return array


def option_array(
    option: str, given: Any, shape: tuple[int, ...], missing: float, accepted: str
) -> FloatArray:
    """Numbers of an option in the shape that the waypoints need; `missing` for `None`.

    Args:
        option: Name of the option.
        given: Its value.
        shape: The shape that it must have.
        missing: What stands for each number if none are given.
        accepted: The accepted values, for the error.

    Raises:
        OptionError: The shape is another.
    """
    if given is None:
        return np.full(shape, missing)
    array = np.asarray(given, dtype=float)
    if array.shape != shape:
        rows = len(array) if array.ndim else "no"
        raise OptionError(option, f"has {rows} rows (shape {array.shape}); {accepted}")
    return array


class Planner(Protocol):
    """A planner: joint waypoints and options in, a trajectory through them out."""

    def __call__(
        self, waypoints: JointWaypoints, options: PlannerOptions | None = None
    ) -> JointTrajectory:
        """Plan a motion.

        Args:
            waypoints: Times [s], shape (n,), positions and velocities [rad or m, per second], shape
                (n, d).
            options: Further options; the defaults for `None`.

        Raises:
            InputError: The planner can't serve these waypoints, or does not support an option.
        """
