"""Shapes of scenes as Drake's."""

import numpy as np
from pydrake import geometry
from pydrake.common import MemoryFile

from rollerbench.visualization.shapes import Box, Cylinder, Ellipsoid, Mesh, Shape


def drake_shape(shape: Shape) -> geometry.Shape:
    """The same shape as one of Drake's."""
    if isinstance(shape, Box):
        return geometry.Box(*shape.size)
    if isinstance(shape, Cylinder):
        return geometry.Cylinder(shape.radius, shape.length)
    if isinstance(shape, Ellipsoid):
        return geometry.Ellipsoid(*shape.radii)
    text = MemoryFile(contents=_wavefront(shape), extension=".obj", filename_hint="mesh")
    return geometry.Mesh(geometry.InMemoryMesh(mesh_file=text), 1.0)


def _wavefront(mesh: Mesh) -> bytes:
    """Triangles as a Wavefront OBJ file, each with its normal; its corners count from 1."""
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"vn {x:.6g} {y:.6g} {z:.6g}" for x, y, z in normals.tolist()]
    faces = enumerate((mesh.faces + 1).tolist(), start=1)
    lines += [f"f {a}//{normal} {b}//{normal} {c}//{normal}" for normal, (a, b, c) in faces]
    return "\n".join(lines).encode("ascii")
