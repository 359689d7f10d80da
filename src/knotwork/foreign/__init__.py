"""Trajectories that other tools wrote, read so that the check can judge them as it judges ours."""

from knotwork.foreign.reading import holds_points, read_trajectory

__all__ = ["holds_points", "read_trajectory"]
