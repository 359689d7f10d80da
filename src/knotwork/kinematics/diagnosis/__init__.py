"""Diagnosis of poses without a solution: the reason, and the closest pose."""
