"""How does a flat piece become a solid piece of glass, and a skin one of clay?

Every piece of a triangulated plane is given two faces, its triangles at z = +d/2 and reversed ones
at z = -d/2 (of a curved surface: its triangles, and reversed ones below them), and a wall of two
triangles along each of its border edges (thesis 3.3, with the second triangle of a wall corrected
to (x1, y1, d1), (x2, y2, d2), (x2, y2, d1)). The result is closed and its normals point outwards:
every directed edge occurs once and its opposite once.

Both pieces at a common wall divide it along the same diagonal, so their walls are the same two
triangles, seen from either side.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partition.fragments import NO_NEIGHBOUR
from partition.graph import NO_TWIN, Ints, cut_apart, cut_twins, twins
from partition.mesh import Mesh

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Surfaces:
    """Triangles with the piece they belong to and the piece behind them.

    vertices (v, 3), faces (f, 3), piece (f,), neighbour (f,): another piece or NO_NEIGHBOUR.
    No vertex is used by two pieces.
    """

    vertices: Floats
    faces: Ints
    piece: Ints
    neighbour: Ints


def extrude(points: Floats, triangles: Ints, label: Ints, thickness: float) -> Surfaces:
    """Solid pieces from points (n, 2), counter-clockwise triangles (t, 3) and their piece (t,)."""
    level = np.full((len(points), 1), thickness / 2)
    return thicken(np.hstack([points, level]), np.hstack([points, -level]), triangles,
                   twins(triangles), label)


def shells(mesh: Mesh, label: Ints, skin: float) -> Surfaces:
    """Pieces of a surface, thickened inwards by `skin` along the normals of its vertices."""
    return thicken(mesh.vertices, mesh.vertices - skin * normals(mesh), mesh.faces, mesh.twin,
                   label)


def sheets(mesh: Mesh, label: Ints) -> Surfaces:
    """The pieces of a surface as they are, without thickness; `label` (f,) is the piece."""
    faces, original = cut_apart(mesh.faces, cut_twins(mesh.twin, label))
    return Surfaces(mesh.vertices[original], faces, label,
                    np.full(len(faces), NO_NEIGHBOUR, dtype=np.int64))


def thicken(front: Floats, back: Floats, triangles: Ints, twin: Ints, label: Ints) -> Surfaces:
    """Solid pieces between two copies (n, 3) of the vertices of a surface; front is outside."""
    flat, original = cut_apart(triangles, cut_twins(twin, label))
    walls = np.flatnonzero(cut_twins(twin, label) == NO_TWIN)
    wall_piece = label[walls // 3]
    behind = np.where(twin[walls] == NO_TWIN, NO_NEIGHBOUR, label[twin[walls] // 3])
    a = flat.ravel()[walls]
    b = np.roll(flat, -1, axis=1).ravel()[walls]
    last = len(original)
    rising = (original[a] < original[b])[:, None]
    lower = np.where(rising, np.stack([a, a + last, b], axis=1),
                     np.stack([a, a + last, b + last], axis=1))
    upper = np.where(rising, np.stack([a + last, b + last, b], axis=1),
                     np.stack([a, b + last, b], axis=1))
    outside = np.full(len(flat), NO_NEIGHBOUR, dtype=np.int64)
    return Surfaces(np.concatenate([front[original], back[original]]),
                    np.concatenate([flat, flat[:, ::-1] + last, lower, upper]),
                    np.concatenate([label, label, wall_piece, wall_piece]),
                    np.concatenate([outside, outside, behind, behind]))


def normals(mesh: Mesh) -> Floats:
    """(v, 3) unit normals of the vertices, the mean of those around, weighted by area."""
    a, b, c = (mesh.vertices[corner] for corner in mesh.faces.T)
    flat = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    total = np.stack([np.bincount(mesh.faces.ravel(), column, len(mesh.vertices))
                      for column in flat.T], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    unit: Floats = np.divide(total, length, out=np.zeros_like(total), where=length > 0)
    return unit
