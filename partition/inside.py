"""Which points lie inside a closed surface?

Those around which it winds. A ray in direction +x counts +1 for every outward triangle through
which it leaves and -1 for every one through which it enters; the sum is the winding number, also
where the surface intersects itself. Triangles are sorted into columns of a grid in y and z, so a
ray meets only those of its column.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from partition.graph import Ints

Floats = NDArray[np.float64]
PER_COLUMN = 2.0    # triangles, on average, if they did not overlap several


def winding(points: Floats, vertices: Floats, faces: Ints) -> Ints:
    """(n,) winding number of a closed, outward surface around each point (n, 3)."""
    low, high = vertices[:, 1:].min(axis=0), vertices[:, 1:].max(axis=0)
    columns = max(1, int(np.sqrt(len(faces) / PER_COLUMN)))
    width = (high - low) / columns * (1 + 1e-9)
    corners = vertices[faces][:, :, 1:]
    first = np.floor((corners.min(axis=1) - low) / width).astype(np.int64)
    last = np.floor((corners.max(axis=1) - low) / width).astype(np.int64)
    start, members = _sorted(first, last, columns)
    return _count(points, vertices, faces, low, width, columns, start, members)


@njit(cache=True)
def _sorted(first: Ints, last: Ints, columns: int) -> tuple[Ints, Ints]:
    """Triangles of each column: members[start[c]:start[c + 1]]."""
    start = np.zeros(columns * columns + 1, dtype=np.int64)
    for t in range(len(first)):
        for j in range(first[t, 0], last[t, 0] + 1):
            for k in range(first[t, 1], last[t, 1] + 1):
                start[j * columns + k + 1] += 1
    start = np.cumsum(start)
    place = start.copy()
    members = np.empty(start[-1], dtype=np.int64)
    for t in range(len(first)):
        for j in range(first[t, 0], last[t, 0] + 1):
            for k in range(first[t, 1], last[t, 1] + 1):
                members[place[j * columns + k]] = t
                place[j * columns + k] += 1
    return start, members


@njit(cache=True)
def _count(points: Floats, vertices: Floats, faces: Ints, low: Floats, width: Floats,
           columns: int, start: Ints, members: Ints) -> Ints:
    number = np.zeros(len(points), dtype=np.int64)
    for i in range(len(points)):
        x, y, z = points[i]
        j, k = int(np.floor((y - low[0]) / width[0])), int(np.floor((z - low[1]) / width[1]))
        if j < 0 or k < 0 or j >= columns or k >= columns:
            continue
        for m in members[start[j * columns + k]:start[j * columns + k + 1]]:
            number[i] += _crossed(x, y, z, vertices[faces[m, 0]], vertices[faces[m, 1]],
                                  vertices[faces[m, 2]])
    return number


@njit(cache=True)
def _crossed(x: float, y: float, z: float, a: Floats, b: Floats, c: Floats) -> int:
    """+1, -1 or 0: the ray from (x, y, z) along +x leaves, enters or misses a triangle.

    An edge belongs to the triangle on one side of it only: the half-open rule y < v is the same
    for both.
    """
    turns = 0
    area = 0.0
    height = 0.0
    for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
        cross = (p[1] - y) * (q[2] - z) - (p[2] - z) * (q[1] - y)
        area += cross
        height += cross * r[0]
        upward = p[1] <= y < q[1]
        downward = q[1] <= y < p[1]
        if upward or downward:
            beyond = p[2] + (q[2] - p[2]) * ((y - p[1]) / (q[1] - p[1])) > z
            if upward and beyond:
                turns += 1
            elif downward and beyond:
                turns -= 1
    if turns == 0 or area == 0.0 or height / area <= x:
        return 0
    return 1 if area > 0 else -1
