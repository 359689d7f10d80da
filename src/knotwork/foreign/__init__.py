"""Trajectories of other tools, read for the check."""

from knotwork.foreign.reading import is_foreign, is_trajectory, read_trajectory

__all__ = ["is_foreign", "is_trajectory", "read_trajectory"]
