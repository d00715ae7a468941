"""What is inside a closed surface?

Tetrahedra, by fTetWild (Hu et al., ACM TOG 39, 2020) through pytetwild, which accepts any surface,
self-intersections included, and leaves it by no more than a thousandth of the body's size. The body
is from then on the tetrahedra: its surface is theirs.

Tetrahedra are the nodes of a dual graph, like triangles: two are joined where they share a face.
Face i of a tetrahedron is the one opposite corner i, counter-clockwise seen from outside.
"""

import contextlib
import tempfile
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from partition.graph import NO_TWIN, Ints, numbered, union
from partition.mesh import Mesh, MeshError

Floats = NDArray[np.float64]
FACES = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])


@dataclass(frozen=True)
class Tetrahedra:
    """Vertices (v, 3) and cells (t, 4) of positive volume."""

    vertices: Floats
    cells: Ints

    @cached_property
    def neighbour(self) -> Ints:
        """(t, 4) the tetrahedron behind each face, NO_TWIN on the surface."""
        key = np.sort(self.cells[:, FACES].reshape(-1, 3), axis=1)
        order = np.lexsort(key.T)
        same = np.flatnonzero((key[order][1:] == key[order][:-1]).all(axis=1))
        across = np.full(len(key), NO_TWIN, dtype=np.int64)
        across[order[same]] = order[same + 1] // 4
        across[order[same + 1]] = order[same] // 4
        return across.reshape(-1, 4)

    @cached_property
    def components(self) -> Ints:
        """(t,) the number of the connected part that each tetrahedron belongs to."""
        cell, side = np.nonzero(self.neighbour != NO_TWIN)
        return numbered(union(len(self.cells), cell, self.neighbour[cell, side]))

    @cached_property
    def volumes(self) -> Floats:
        """(t,) of each tetrahedron."""
        a, b, c, d = (self.vertices[corner] for corner in self.cells.T)
        volume: Floats = ((b - a) * np.cross(c - a, d - a)).sum(axis=1) / 6
        return volume

    @property
    def centres(self) -> Floats:
        """(t, 3) mean of the corners."""
        centre: Floats = self.vertices[self.cells].mean(axis=1)
        return centre

    def part(self, members: Ints) -> "Tetrahedra":
        """Some of the tetrahedra, with the same vertices."""
        return Tetrahedra(self.vertices, self.cells[members])

    def surface(self) -> tuple[Ints, Ints]:
        """Triangles (f, 3) of the surface and the tetrahedron (f,) behind each."""
        cell, side = np.nonzero(self.neighbour == NO_TWIN)
        return self.cells[cell[:, None], FACES[side]], cell


def fill(mesh: Mesh, name: str) -> Tetrahedra:
    """Tetrahedra inside a closed mesh; raises MeshError."""
    import pytetwild

    if not mesh.closed:
        raise MeshError(f"{name}: interior = 'solid': the surface has a border; fix: close it, or "
                        "set interior = \"shell\"")
    # fTetWild leaves a file in the working directory
    with tempfile.TemporaryDirectory() as scratch, contextlib.chdir(scratch):
        vertices, found = pytetwild.tetrahedralize(mesh.vertices, mesh.faces.astype(np.int32),
                                                   num_threads=1, quiet=True)
    cells: Ints = found.astype(np.int64)
    volume = Tetrahedra(vertices, cells).volumes
    cells[volume < 0] = cells[volume < 0][:, [0, 2, 1, 3]]
    return Tetrahedra(vertices, cells[volume != 0])
