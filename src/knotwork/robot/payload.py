"""`Payload`: mass, centre of mass and inertia of a load, validated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.arrays import FloatArray, ReadOnlyArrays, checked_array
from knotwork.errors import InputError

INERTIA_TOLERANCE = 1e-3
"""Tolerance of the triangle inequality of moments of inertia, which are often rounded, relative to
the largest one."""


@dataclass(frozen=True, eq=False)
class Payload(ReadOnlyArrays):
    """A load of the tool: of its frame, or an object that it holds.

    Attributes:
        mass: Mass [kg]; zero for no load.
        centre_of_mass: Centre of mass in the axes of the tool frame, or for a held object in those
            of the TCP [m], shape (3,).
        inertia: Inertia about the centre of mass, in the same axes [kg m²], shape (3, 3); by
            default zero, a point mass.

    Raises:
        InputError: A value is not finite, the mass is negative, or the inertia is impossible: see
            `find_payload_fault`.

    >>> Payload(2.0, [0, 0, 0.06], np.diag([0.01, 0.01, 0.004])).mass
    2.0
    """

    mass: float
    centre_of_mass: FloatArray = (0.0, 0.0, 0.0)  # type: ignore[assignment]
    inertia: FloatArray | None = None

    def __post_init__(self) -> None:
        inertia = self.inertia
        moments = checked_array(np.zeros((3, 3)) if inertia is None else inertia, (3, 3), "inertia")
        mass = float(checked_array(self.mass, (), "mass"))
        fault = find_payload_fault(mass, None if inertia is None else moments)
        if fault is not None:
            raise InputError("payload: {} {}; give {}".format(*fault))
        centre = checked_array(self.centre_of_mass, (3,), "centre of mass")
        for name, value in (("mass", mass), ("centre_of_mass", centre), ("inertia", moments)):
            object.__setattr__(self, name, value)

    @property
    def key(self) -> bytes:
        """Key of all values, the same for equal bodies."""
        return b"".join(np.asarray(value).tobytes() for value in vars(self).values())


def find_payload_fault(mass: float, inertia: FloatArray | None) -> tuple[str, str, str] | None:
    """Explain why a mass and inertia are impossible.

    Args:
        mass: Mass [kg].
        inertia: Inertia about the centre of mass [kg m²], shape (3, 3), or `None` for a point mass.

    Returns:
        Name of the value, the problem, and the accepted values; `None` if they are possible.
    """
    if mass < 0.0:
        return "mass", f"is {mass:g} kg", "a positive number, or zero for no payload"
    if inertia is None:
        return None
    if mass == 0.0:
        return "inertia", "is given, but the mass is zero", "a mass above zero, or no inertia"
    if np.abs(inertia - inertia.T).max() > INERTIA_TOLERANCE * np.abs(inertia).max():
        return "inertia", f"is not symmetric: {inertia.tolist()}", "a symmetric matrix"
    moments = np.linalg.eigvalsh(inertia)
    moments_text = "has the principal moments {:.4g}, {:.4g} and {:.4g} kg m²".format(*moments)
    if not moments[0] > 0.0:
        accepted = "three positive moments, or no inertia for a point mass"
        return "inertia", f"{moments_text}, which is not positive definite", accepted
    if moments[2] > (1.0 + INERTIA_TOLERANCE) * (moments[0] + moments[1]):
        accepted = "moments about the centre of mass of which none is above the sum of the others"
        return "inertia", f"{moments_text}, which no body has", accepted
    return None
