"""Trajectories that other tools wrote, read so that the check can judge them as it judges ours."""

from knotwork.foreign.reading import is_foreign, is_trajectory, read_trajectory

__all__ = ["is_foreign", "is_trajectory", "read_trajectory"]
