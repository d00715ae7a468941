"""How does a flat piece become a solid piece of glass?

Every piece of a triangulated plane is given two faces, its triangles at z = +d/2 and reversed ones
at z = -d/2, and a wall of two triangles along each of its border edges (thesis 3.3, with the
second triangle of a wall corrected to (x1, y1, d1), (x2, y2, d2), (x2, y2, d1)). The result is
closed and its normals point outwards: every directed edge occurs once and its opposite once.

Both pieces at a common wall divide it along the same diagonal, so their walls are the same two
triangles, seen from either side.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partition.fragments import NO_NEIGHBOUR
from partition.graph import NO_TWIN, Ints, cut_twins, separate, twins

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
    whole = twins(triangles)
    flat, original = separate(triangles, cut_twins(whole, label))
    walls = np.flatnonzero(cut_twins(whole, label) == NO_TWIN)
    wall_piece = label[walls // 3]
    behind = np.where(whole[walls] == NO_TWIN, NO_NEIGHBOUR, label[whole[walls] // 3])
    a = flat.ravel()[walls]
    b = np.roll(flat, -1, axis=1).ravel()[walls]
    back = len(original)
    rising = (original[a] < original[b])[:, None]
    lower = np.where(rising, np.stack([a, a + back, b], axis=1),
                     np.stack([a, a + back, b + back], axis=1))
    upper = np.where(rising, np.stack([a + back, b + back, b], axis=1),
                     np.stack([a, b + back, b], axis=1))
    outside = np.full(len(flat), NO_NEIGHBOUR, dtype=np.int64)
    plane = points[original]
    level = np.full((back, 1), thickness / 2)
    return Surfaces(np.concatenate([np.hstack([plane, level]), np.hstack([plane, -level])]),
                    np.concatenate([flat, flat[:, ::-1] + back, lower, upper]),
                    np.concatenate([label, label, wall_piece, wall_piece]),
                    np.concatenate([outside, outside, behind, behind]))


def shells(vertices: Floats, faces: Ints, label: Ints) -> Surfaces:
    """The pieces of a surface as they are, without thickness; `label` (f,) is the piece."""
    flat, original = separate(faces, cut_twins(twins(faces), label))
    return Surfaces(vertices[original], flat, label,
                    np.full(len(faces), NO_NEIGHBOUR, dtype=np.int64))
