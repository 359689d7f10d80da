"""Trajectories of other tools, read for the check."""

from knotwork.files.foreign.trajectory_files import is_foreign, is_trajectory, read_trajectory

__all__ = ["is_foreign", "is_trajectory", "read_trajectory"]
