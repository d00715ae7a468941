"""How large is a piece, and where is its centre?

With triangles (a, b, c) of a surface: area = sum |(b - a) x (c - a)| / 2. A closed, outward surface
encloses volume = sum a . (b x c) / 6, and the centre of that volume is
sum (a + b + c) / 4 * a . (b x c) / 6 / volume (tetrahedra from a common apex). An open piece is a
sheet: its volume is 0 and its centre that of its area.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
AnyInts = NDArray[np.integer]


def squared(vectors: Floats) -> Floats:
    """(n,) squared length of vectors (n, 3)."""
    x, y, z = vectors.T
    return x * x + y * y + z * z


def cross(u: Floats, v: Floats) -> Floats:
    """(n, 3) cross products of vectors (n, 3); numpy's own moves axes about and is slower."""
    out = np.empty_like(u)
    out[:, 0] = u[:, 1] * v[:, 2] - u[:, 2] * v[:, 1]
    out[:, 1] = u[:, 2] * v[:, 0] - u[:, 0] * v[:, 2]
    out[:, 2] = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    return out


def area_vectors(vertices: Floats, faces: AnyInts) -> Floats:
    """(f, 3) the outward normal of each triangle, as long as the triangle is large."""
    a, b, c = (vertices[corner] for corner in np.ascontiguousarray(faces.T))
    return cross(b - a, c - a) / 2


def triangle_areas(vertices: Floats, faces: AnyInts) -> Floats:
    """(f,) area of each triangle."""
    area: Floats = np.sqrt(squared(area_vectors(vertices, faces)))
    return area


def tetrahedra(vertices: Floats, faces: AnyInts) -> Floats:
    """(f,) signed volume between each triangle and the origin."""
    a, b, c = (vertices[corner] for corner in np.ascontiguousarray(faces.T))
    volume: Floats = np.einsum("ij,ij->i", a, cross(b, c)) / 6
    return volume


def measures(vertices: Floats, faces: AnyInts, piece: AnyInts,
             closed: NDArray[np.bool_]) -> tuple[Floats, Floats, Floats]:
    """Area (n,), volume (n,) and centre (n, 3) of n pieces; `piece` (f,) owns each triangle."""
    count = len(closed)
    corners = vertices[faces]
    area = triangle_areas(vertices, faces)
    total = np.bincount(piece, area, count).astype(np.float64)
    centre = _sum(piece, corners.mean(axis=1) * area[:, None], count) / total[:, None]
    # relative to a point of the piece itself, so that no digits are lost far from the origin
    a, b, c = np.moveaxis(corners - centre[piece][:, None, :], 1, 0)
    tetrahedron = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    volume = np.where(closed, np.bincount(piece, tetrahedron, count), 0.0)
    moment = _sum(piece, (a + b + c) / 4 * tetrahedron[:, None], count)
    solid = closed & (volume > 0)
    centre[solid] += moment[solid] / volume[solid, None]
    return total, volume, centre


def _sum(piece: AnyInts, values: Floats, count: int) -> Floats:
    return np.stack([np.bincount(piece, column, count) for column in values.T], axis=1)
