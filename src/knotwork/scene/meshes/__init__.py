"""Mesh files: triangles with the colours of their materials. This package does not draw."""
