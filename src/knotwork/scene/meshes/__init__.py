"""Mesh files, found and read: triangles with the colours and images of their materials.

`reading.read_mesh` reads one file, `finding.find_mesh` finds the file that a URDF names. Nothing
here draws.
"""
