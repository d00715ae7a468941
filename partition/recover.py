"""Which sides of a surface have to be halved before tetrahedra have it as their boundary?

Those that are no edges of tetrahedra, and the longest side of every triangle that is none of their
faces although its sides are edges. The new vertices become points of the tetrahedra, and the
question is asked again of the halved triangles.
"""

import numpy as np
from numpy.typing import NDArray

from partition.graph import Ints

Floats = NDArray[np.float64]
FACES = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])     # of a tetrahedron
EDGES = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])
BASE = 1 << 21      # beyond the number of any vertex: three of them fit in 64 bits


def absent(points: Floats, triangles: Ints, cells: Ints) -> NDArray[np.bool_]:
    """(f, 3) which sides of triangles (f, 3) to halve; cells (t, 4) are tetrahedra."""
    split = ~np.isin(_sides(triangles), _key(cells[:, EDGES]))
    hidden = ~np.isin(_key(triangles), _key(cells[:, FACES])) & ~split.any(axis=1)
    corners = points[triangles[hidden]]
    length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    split[np.flatnonzero(hidden), length.argmax(axis=1)] = True
    return split


def halved(triangles: Ints, split: NDArray[np.bool_], first: int) -> tuple[Ints, Ints]:
    """Triangles (f, 3) with some of their sides (f, 3) halved by new vertices first, first + 1,
    ..., and between which two (m, 2) each of these stands."""
    halves = np.unique(_sides(triangles)[split])
    while True:
        side = _sides(triangles)
        found = np.isin(side, halves)
        which = np.flatnonzero(found.any(axis=1))
        if len(which) == 0:
            return triangles, np.stack(np.divmod(halves, BASE), axis=1)
        one = found[which].argmax(axis=1)
        a, b, c = (triangles[which, (one + k) % 3] for k in range(3))
        middle = first + np.searchsorted(halves, side[which, one])
        triangles = np.concatenate([np.delete(triangles, which, axis=0),
                                    np.stack([a, middle, c], axis=1),
                                    np.stack([middle, b, c], axis=1)])


def _sides(triangles: Ints) -> Ints:
    """(f, 3) a number for every side, the same for both triangles that share it."""
    return _key(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2))


def _key(corners: Ints) -> Ints:
    """(...) one number for k vertices (..., k), whatever their order."""
    ordered = np.sort(corners, axis=-1).astype(np.int64)
    key = ordered[..., 0]
    for corner in range(1, ordered.shape[-1]):
        key = key * BASE + ordered[..., corner]
    return key
