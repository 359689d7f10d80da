"""Mesh files: triangles with the colours and images of their materials; nothing here draws."""
