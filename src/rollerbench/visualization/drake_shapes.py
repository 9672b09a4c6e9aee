"""Shapes of scenes as Drake's."""

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
    """Triangles as a Wavefront OBJ file; its corners count from 1."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (mesh.faces + 1).tolist()]
    return "\n".join(lines).encode("ascii")
