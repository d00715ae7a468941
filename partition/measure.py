"""How large is a piece, and where is its centre?

With triangles (a, b, c) of a surface: area = sum |(b - a) x (c - a)| / 2. A closed, outward surface
encloses volume = sum a . (b x c) / 6, and the centre of that volume is
sum (a + b + c) / 4 * a . (b x c) / 6 / volume (tetrahedra from a common apex). An open piece is a
sheet: its volume is 0 and its centre that of its area.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
AnyInts = NDArray[np.integer]


@njit(cache=True)
def area_vectors(vertices: Floats, faces: AnyInts) -> Floats:
    """(f, 3) the outward normal of each triangle, as long as the triangle is large."""
    normal = np.empty((len(faces), 3))
    for f in range(len(faces)):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        for x in range(3):
            y, z = (x + 1) % 3, (x + 2) % 3
            normal[f, x] = ((b[y] - a[y]) * (c[z] - a[z]) - (b[z] - a[z]) * (c[y] - a[y])) / 2
    return normal


@njit(cache=True)
def triangle_areas(vertices: Floats, faces: AnyInts) -> Floats:
    """(f,) area of each triangle."""
    normal = area_vectors(vertices, faces)
    area = np.empty(len(faces))
    for f in range(len(faces)):
        area[f] = np.sqrt(normal[f, 0]**2 + normal[f, 1]**2 + normal[f, 2]**2)
    return area


@njit(cache=True)
def centres(vertices: Floats, faces: AnyInts) -> Floats:
    """(f, 3) the mean of the corners of each triangle."""
    centre = np.empty((len(faces), 3))
    for f in range(len(faces)):
        for x in range(3):
            centre[f, x] = (vertices[faces[f, 0], x] + vertices[faces[f, 1], x]
                            + vertices[faces[f, 2], x]) / 3
    return centre


@njit(cache=True)
def tetrahedra(vertices: Floats, faces: AnyInts, apex: Floats) -> Floats:
    """(f,) signed volume between each triangle and a point (3,)."""
    volume = np.empty(len(faces))
    for f in range(len(faces)):
        volume[f] = _tetrahedron(vertices, faces[f], apex)
    return volume


@njit(cache=True)
def _tetrahedron(vertices: Floats, corners: AnyInts, apex: Floats) -> float:
    a, b, c = vertices[corners[0]], vertices[corners[1]], vertices[corners[2]]
    total = 0.0
    for x in range(3):
        y, z = (x + 1) % 3, (x + 2) % 3
        total += (a[x] - apex[x]) * ((b[y] - apex[y]) * (c[z] - apex[z])
                                     - (b[z] - apex[z]) * (c[y] - apex[y]))
    return float(total / 6)


@njit(cache=True)
def measures(vertices: Floats, faces: AnyInts, piece: AnyInts,
             closed: NDArray[np.bool_]) -> tuple[Floats, Floats, Floats]:
    """Area (n,), volume (n,) and centre (n, 3) of n pieces; `piece` (f,) owns each triangle."""
    area, middle = triangle_areas(vertices, faces), centres(vertices, faces)
    total, volume = np.zeros(len(closed)), np.zeros(len(closed))
    centre, moment = np.zeros((len(closed), 3)), np.zeros((len(closed), 3))
    for f in range(len(faces)):
        total[piece[f]] += area[f]
        centre[piece[f]] += area[f] * middle[f]
    for p in range(len(closed)):
        centre[p] /= total[p]
    # relative to a point of the piece itself, so that no digits are lost far from the origin
    for f in range(len(faces)):
        p = piece[f]
        if closed[p]:
            part = _tetrahedron(vertices, faces[f], centre[p])
            volume[p] += part
            moment[p] += part * 3 / 4 * (middle[f] - centre[p])
    for p in range(len(closed)):
        if volume[p] > 0:
            centre[p] += moment[p] / volume[p]
    return total, volume, centre
