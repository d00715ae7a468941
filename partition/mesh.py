"""How is a triangle mesh read from a file and made fit for cutting?"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partition.graph import NO_TWIN, Ints, components, separate, twins

Floats = NDArray[np.float64]


class MeshError(Exception):
    """A mesh that cannot be used; the message is one line for the user."""


@dataclass(frozen=True)
class Mesh:
    """Vertices (v, 3), faces (f, 3) and the twin (3 f,) of every side."""

    vertices: Floats
    faces: Ints
    twin: Ints

    @property
    def closed(self) -> bool:
        """Whether it has no border."""
        return not np.any(self.twin == NO_TWIN)

    @property
    def components(self) -> Ints:
        """(f,) the number of the connected part that each triangle belongs to."""
        return components(self.faces, self.twin)


def mesh_of(vertices: Floats, faces: Ints, name: str) -> Mesh:
    """Weld vertices at the same place and split those where only a point is shared."""
    vertices, welded = np.unique(vertices, axis=0, return_inverse=True)
    faces = welded.reshape(-1)[faces]
    try:
        twin = twins(faces)
    except ValueError as error:
        raise MeshError(f"{name}: {error}; fix: remove the surplus triangles") from None
    faces, original = separate(faces, twin)
    return Mesh(vertices[original], faces, twin)


def read(path: Path) -> Mesh:
    """Read a file that meshio knows; raises MeshError."""
    import meshio

    if not path.is_file():
        raise MeshError(f"{path}: no such mesh; fix: give the path of a mesh file")
    try:
        data = meshio.read(path)
    except (meshio.ReadError, OSError, ValueError, IndexError, KeyError) as error:
        raise MeshError(f"{path}: cannot be read as a mesh ({error}); fix: give a triangle mesh "
                        "such as OBJ, PLY, STL or VTK") from None
    faces = [block.data for block in data.cells if block.type == "triangle"]
    if not faces:
        raise MeshError(f"{path}: holds no triangles; fix: triangulate it")
    points = np.asarray(data.points, dtype=np.float64)
    if points.shape[1:] != (3,) or not np.all(np.isfinite(points)):
        raise MeshError(f"{path}: a vertex is not three finite numbers; fix: correct the file")
    return mesh_of(points, np.concatenate(faces).astype(np.int64), str(path))
