"""Collision-free motions between two states: C2, cubic, proved clear."""
