"""Trajectories that other tools wrote, read so that the check can judge them as it judges ours."""

from knotwork.foreign.reading import read_trajectory

__all__ = ["read_trajectory"]
