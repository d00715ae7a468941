"""How do points in the plane become triangles?

Both methods use every point, cover the convex hull, and give 2 n - 2 - h triangles for n points of
which h lie on the hull's border.

trisection  the thesis' way (3.3): the hull is fanned out from one point, then every further point
            divides the triangle that contains it in three. A point on an edge would belong to no
            open triangle and be lost; here it divides the one or two triangles of that edge in two.
delaunay    no point lies inside the circumcircle of a triangle; by Qhull through scipy.

Whether a point lies left of, right of, or on an edge is decided exactly: in floating point where
Shewchuk's error bound (Discrete Comput. Geom. 18, 1997) allows it, in rationals where not.
"""

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay, QhullError

from partition.bfs import PartitionError
from partition.graph import Ints

Floats = NDArray[np.float64]
Index = Ints | int
ORIENTATION_ERROR = (3 + 16 * 2.0**-53) * 2.0**-53


class TriangulationError(PartitionError):
    """Points that span no area; the message is one line for the user."""


def orientation(points: Floats, a: Index, b: Index, c: Index) -> Ints:
    """Sign of the area of each triangle (a, b, c) of point numbers: +1 if counter-clockwise."""
    a, b, c = np.broadcast_arrays(a, b, c)
    left = (points[a, 0] - points[c, 0]) * (points[b, 1] - points[c, 1])
    right = (points[a, 1] - points[c, 1]) * (points[b, 0] - points[c, 0])
    area = left - right
    sign = np.asarray(np.sign(area), dtype=np.int64)
    doubtful = np.abs(area) <= ORIENTATION_ERROR * (np.abs(left) + np.abs(right))
    for index in np.argwhere(doubtful):
        where = tuple(index)
        sign[where] = _exact_sign(points[a[where]], points[b[where]], points[c[where]])
    return sign


def _exact_sign(a: Floats, b: Floats, c: Floats) -> int:
    ax, ay, bx, by, cx, cy = (Fraction(float(value)) for value in (*a, *b, *c))
    area = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return (area > 0) - (area < 0)


def trisection(points: Floats) -> Ints:
    """(t, 3) counter-clockwise triangles of points (n, 2) by trisection, in the order given."""
    corners = hull(_checked(points))
    inside = np.ones(len(points), dtype=bool)
    inside[corners] = False
    following = np.roll(corners, -1)
    others = np.flatnonzero(inside)
    turns = orientation(points, corners[:, None], following[:, None], others[None, :])
    strictly = others[np.all(turns > 0, axis=0)]
    if len(strictly) == 0:
        fan = [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:], strict=False)]
        return _insert(points, fan, others)
    hub = strictly[0]
    fan = [(hub, a, b) for a, b in zip(corners, following, strict=True)]
    return _insert(points, fan, others[others != hub])


def delaunay(points: Floats) -> Ints:
    """(t, 3) counter-clockwise Delaunay triangles of points (n, 2)."""
    hull(_checked(points))
    try:
        triangles = Delaunay(points).simplices.astype(np.int64)
    except QhullError as error:
        raise TriangulationError(f"Qhull: {str(error).splitlines()[0]}") from None
    turn = orientation(points, *triangles.T)
    triangles[turn < 0] = triangles[turn < 0][:, ::-1]
    triangles = triangles[turn != 0]
    missed = np.setdiff1d(np.arange(len(points)), triangles)
    return _insert(points, list(map(tuple, triangles)), missed)


def _checked(points: Floats) -> Floats:
    if not np.all(np.isfinite(points)):
        raise TriangulationError("a point is not finite; fix: give finite coordinates")
    if len(np.unique(points, axis=0)) < len(points):
        raise TriangulationError("a point is given twice; fix: give each point once")
    return points


def hull(points: Floats) -> Ints:
    """Strict corners of the convex hull, counter-clockwise (Andrew's monotone chain)."""
    order = np.lexsort((points[:, 1], points[:, 0]))
    chains = []
    for path in (order, order[::-1]):
        chain: list[int] = []
        for point in path:
            while len(chain) > 1 and orientation(points, chain[-2], chain[-1], point) <= 0:
                chain.pop()
            chain.append(point)
        chains.append(chain[:-1])
    corners = np.array(chains[0] + chains[1], dtype=np.int64)
    if len(corners) < 3:
        raise TriangulationError("the points lie on one line; fix: give three that do not")
    return corners


def _insert(points: Floats, start: list[tuple[int, int, int]], new: Ints) -> Ints:
    """Insert points one by one, each into the triangle or the edge that holds it."""
    triangles = np.zeros((len(start) + 2 * len(new), 3), dtype=np.int64)
    triangles[:len(start)] = start
    count = len(start)
    for point in new:
        a, b, c = triangles[:count].T
        turns = np.stack([orientation(points, a, b, point), orientation(points, b, c, point),
                          orientation(points, c, a, point)], axis=1)
        for found in np.flatnonzero(np.all(turns >= 0, axis=1)):
            pieces = _divided(triangles[found], turns[found], point)
            triangles[found] = pieces[0]
            triangles[count:count + len(pieces) - 1] = pieces[1:]
            count += len(pieces) - 1
    return triangles[:count]


def _divided(triangle: Ints, turns: Ints, point: int) -> list[tuple[int, int, int]]:
    """The triangles that replace one: a new one on each side that the point is not on."""
    return [(triangle[side], triangle[(side + 1) % 3], point)
            for side in range(3) if turns[side] > 0]
