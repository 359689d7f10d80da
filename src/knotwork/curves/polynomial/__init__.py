"""Piecewise polynomials: evaluation, calculus, measured jumps and exact extrema.

Source: the local power basis of `scipy.interpolate.PPoly`, whose shapes and conventions are kept.
"""

from knotwork.curves.polynomial.extrema import Extrema
from knotwork.curves.polynomial.piecewise import PiecewisePolynomial

__all__ = ["Extrema", "PiecewisePolynomial"]
