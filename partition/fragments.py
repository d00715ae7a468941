"""What a partition hands on: the pieces of all bodies, as triangle surfaces at rest.

Vertices stand in box coordinates at t = 0. Each piece owns its vertices and faces (nothing is
shared), so piece i is `vertices[vertex_start[i]:vertex_start[i + 1]]` and
`faces[face_start[i]:face_start[i + 1]]`; the indices in `faces` count from the first vertex of all.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FORMAT = "brisance-fragments"
NO_NEIGHBOUR = -1


@dataclass(frozen=True)
class Fragments:
    """Pieces of bodies.

    vertices        (nv, 3) float64, L
    faces           (nf, 3) int32, counter-clockwise seen from outside
    face_neighbour  (nf,) int32: the piece on the other side of an inner fracture face,
                    NO_NEIGHBOUR on the body's own surface
    vertex_start    (n + 1,) int32, face_start (n + 1,) int32
    body            (n,) int32: index into `names`
    closed          (n,) bool: the piece is a closed surface, its volume is meaningful
    names           names of the bodies, in the order of the scene
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    face_neighbour: NDArray[np.int32]
    vertex_start: NDArray[np.int32]
    face_start: NDArray[np.int32]
    body: NDArray[np.int32]
    closed: NDArray[np.bool_]
    names: tuple[str, ...]

    @property
    def count(self) -> int:
        """Number of pieces."""
        return len(self.body)

    def piece(self, index: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Vertices (m, 3) and faces (k, 3) of one piece, the faces indexing these vertices."""
        first, last = self.vertex_start[index:index + 2]
        faces = self.faces[self.face_start[index]:self.face_start[index + 1]]
        return self.vertices[first:last], faces - first

    @property
    def piece_of_face(self) -> NDArray[np.int32]:
        """(nf,) the piece that owns each face."""
        return np.repeat(np.arange(self.count, dtype=np.int32), np.diff(self.face_start))

    @property
    def piece_of_vertex(self) -> NDArray[np.int32]:
        """(nv,) the piece that owns each vertex."""
        return np.repeat(np.arange(self.count, dtype=np.int32), np.diff(self.vertex_start))
