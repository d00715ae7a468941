"""How does a polygon with more than three corners become triangles?

By ear clipping in the plane in which it lies best (its Newell normal): the ear whose smallest
angle is largest is cut off, until a triangle is left, so a polygon with a notch is not covered
twice. Four corners, of which there may be millions, are halved by the better diagonal.
"""

import numpy as np
from numpy.typing import NDArray

from partition.graph import Ints

Floats = NDArray[np.float64]


@np.errstate(invalid="ignore", over="ignore")   # what is not finite is refused with the surface
def ears(points: Floats) -> Ints:
    """(n - 2, 3) corner numbers of the triangles of a polygon (n, 3), wound as it is."""
    flat = _flattened(points)
    left = list(range(len(points)))
    triangles = []
    while len(left) > 3:
        quality = [_quality(flat, left, place) for place in range(len(left))]
        best = int(np.argmax(quality))
        triangles.append((left[best - 1], left[best], left[(best + 1) % len(left)]))
        del left[best]
    return np.array([*triangles, left], dtype=np.int64)


@np.errstate(invalid="ignore", over="ignore")
def halves(vertices: Floats, quads: Ints) -> Ints:
    """(2 q, 3) triangles of quadrilaterals (q, 4), by the diagonal that leaves the wider angles."""
    a, b, c, d = (vertices[quads[:, corner]] for corner in range(4))
    normal = np.cross(c - a, d - b)
    first = np.minimum(_width(a, b, c, normal), _width(a, c, d, normal))
    second = np.minimum(_width(b, c, d, normal), _width(b, d, a, normal))
    better = (first >= second)[:, None]
    return np.concatenate([np.where(better, quads[:, [0, 1, 2]], quads[:, [1, 2, 3]]),
                           np.where(better, quads[:, [0, 2, 3]], quads[:, [1, 3, 0]])])


def _width(a: Floats, b: Floats, c: Floats, normal: Floats) -> Floats:
    """Signed area seen along the normal, over the longest edge squared; 0 for a point."""
    area = np.einsum("ij,ij->i", np.cross(b - a, c - a), normal)
    longest = np.max([np.einsum("ij,ij->i", e, e) for e in (b - a, c - b, a - c)], axis=0)
    scale = longest * np.linalg.norm(normal, axis=1)
    return np.divide(area, scale, out=np.zeros_like(area), where=scale > 0)


def _flattened(points: Floats) -> Floats:
    """(n, 2) the polygon in its plane, counter-clockwise."""
    rest = points - points.mean(axis=0)
    following = np.roll(rest, -1, axis=0)
    normal = np.cross(rest, following).sum(axis=0)
    drop = int(np.argmax(abs(normal)))
    axes = [(1, 2), (2, 0), (0, 1)][drop]
    flat = rest[:, axes]
    return flat if normal[drop] >= 0 else flat * (-1, 1)


def _quality(flat: Floats, left: list[int], place: int) -> float:
    """Sine of the smallest angle of the ear at `place`; negative where there is none."""
    corners = flat[[left[place - 1], left[place], left[(place + 1) % len(left)]]]
    edges = np.roll(corners, -1, axis=0) - corners
    twice_area = _cross(edges[0], edges[1])
    if twice_area <= 0:
        return -1.0
    others = [flat[i] for i in left if not (flat[i] == corners).all(axis=1).any()]
    for point in others:
        if all(_cross(edge, point - corner) >= 0 for edge, corner in zip(edges, corners,
                                                                         strict=True)):
            return -0.5
    lengths = np.linalg.norm(edges, axis=1)
    return float(min(twice_area / (lengths[i] * lengths[i - 1]) for i in range(3)))


def _cross(a: Floats, b: Floats) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
