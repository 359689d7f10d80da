"""Trajectories of other tools, read for the check."""

from knotwork.foreign.trajectory_files import is_foreign, is_trajectory, read_trajectory

__all__ = ["is_foreign", "is_trajectory", "read_trajectory"]
