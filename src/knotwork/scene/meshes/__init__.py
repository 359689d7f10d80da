"""Mesh files: triangles with the colours of their materials; nothing here draws."""
