"""What a partition hands on: the pieces of all bodies, as triangle surfaces at rest.

Vertices stand in box coordinates at t = 0. Each piece owns its vertices and faces (nothing is
shared), so piece i is `vertices[vertex_start[i]:vertex_start[i + 1]]` and
`faces[face_start[i]:face_start[i + 1]]`; the indices in `faces` count from the first vertex of all.

In a file (`write`, `read`) the arrays stand under the names below; beside them is `pieces`, a table
for the reader of an HDF5 viewer: body, triangles, area [L2], volume [L3] and centre [L] of each.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partition.measure import measures
from solver import files, files_whole

FORMAT = "brisance-fragments"
NO_NEIGHBOUR = -1
ARRAYS = {"vertices": np.float64, "faces": np.int32, "face_neighbour": np.int32,
          "vertex_start": np.int32, "face_start": np.int32, "body": np.int32, "closed": np.bool_}


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

    def measures(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Area (n,), volume (n,; 0 if open) and centre (n, 3) of every piece."""
        return measures(self.vertices, self.faces, self.piece_of_face, self.closed)


def write(path: str | Path, fragments: Fragments, attributes: Mapping[str, Any]) -> None:
    """Write fragments.h5; `attributes` (how they were made) go to the root of the file."""
    files_whole.write_tree(path, FORMAT, to_tree(fragments), {"units": "L", **attributes})


def read(path: str | Path) -> Fragments:
    """Read fragments.h5; raises `solver.files.FileError` on any other or damaged file."""
    tree, _ = files.read_tree(path, FORMAT)
    try:
        return from_tree(tree)
    except files.DAMAGE as error:
        raise files.FileError(f"{path}: damaged ({error}); fix: make it again with "
                              "python -m partition") from None


def to_tree(fragments: Fragments) -> dict[str, Any]:
    """The arrays, the names and the table of pieces, by the names that they have in the file."""
    return {"pieces": table(fragments), "names": list(fragments.names),
            **{name: np.asarray(getattr(fragments, name), kind) for name, kind in ARRAYS.items()}}


def from_tree(tree: Mapping[str, Any]) -> Fragments:
    """The inverse of `to_tree`; raises KeyError or ValueError where the arrays do not fit."""
    arrays = {name: np.asarray(tree[name]) for name in ARRAYS}
    for name, kind in ARRAYS.items():
        if arrays[name].dtype != kind:
            raise ValueError(f"{name} holds {arrays[name].dtype}, not {np.dtype(kind)}")
    fragments = Fragments(**arrays, names=tuple(str(name) for name in tree["names"]))
    _check(fragments)
    return fragments


def table(fragments: Fragments) -> NDArray[np.void]:
    """(n,) one record per piece: body, triangles, area, volume, centre_x, centre_y, centre_z."""
    area, volume, centre = fragments.measures()
    names = np.array([name.encode() for name in fragments.names] or [b""])
    columns = {"body": names[fragments.body], "triangles": np.diff(fragments.face_start),
               "area": area, "volume": volume, "centre_x": centre[:, 0],
               "centre_y": centre[:, 1], "centre_z": centre[:, 2]}
    records = np.empty(fragments.count, [(name, c.dtype) for name, c in columns.items()])
    for name, column in columns.items():
        records[name] = column
    return records


def _check(fragments: Fragments) -> None:
    """Raises ValueError unless the arrays have matching lengths and indices in range."""
    vertices, faces, pieces = len(fragments.vertices), len(fragments.faces), fragments.count
    for name, last in (("vertex_start", vertices), ("face_start", faces)):
        start = getattr(fragments, name)
        if len(start) != pieces + 1 or start[0] != 0 or start[-1] != last \
                or np.any(np.diff(start) < 0):
            raise ValueError(f"{name} does not divide {last} rows into {pieces} pieces")
    if fragments.vertices.shape != (vertices, 3) or fragments.faces.shape != (faces, 3):
        raise ValueError("vertices and faces must have three columns")
    if len(fragments.closed) != pieces or len(fragments.face_neighbour) != faces:
        raise ValueError("closed or face_neighbour has the wrong length")
    if not np.all(np.isfinite(fragments.vertices)):
        raise ValueError("a vertex is not finite")
    _check_range("body", fragments.body, 0, len(fragments.names))
    _check_range("face_neighbour", fragments.face_neighbour, NO_NEIGHBOUR, pieces)
    owner = fragments.piece_of_face
    _check_range("faces", fragments.faces - fragments.vertex_start[owner][:, None], 0,
                 np.diff(fragments.vertex_start)[owner][:, None])


def _check_range(name: str, values: NDArray[np.int32], low: int,
                 high: int | NDArray[np.int32]) -> None:
    if np.any(values < low) or np.any(values >= high):
        raise ValueError(f"{name} has an index out of range")
