"""What surfaces do bodies have before they are broken?

Each function returns vertices (v, 3) around the origin and outward faces (f, 3). `place` puts
them into the scene: scaled, turned about the x, then the y, then the z axis, and moved so that the
centre of the bounding box they had before being turned arrives at the given position.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from partition.graph import Ints, sides

Floats = NDArray[np.float64]
GOLDEN = (1 + 5**0.5) / 2


def box(size: tuple[float, float, float], detail: int) -> tuple[Floats, Ints]:
    """A box with the given edges; each of its 12 triangles is divided in four `detail` times."""
    vertices = np.array(list(product((-0.5, 0.5), repeat=3)))
    squares = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([(a, b, c) for s in squares for a, b, c in ((s[0], s[1], s[2]),
                                                                 (s[0], s[2], s[3]))])
    for _ in range(detail):
        vertices, faces = subdivide(vertices, faces)
    return vertices * size, faces


def sphere(radius: float, detail: int) -> tuple[Floats, Ints]:
    """An icosahedron whose 20 triangles are divided in four `detail` times, blown up."""
    short = [(0, s, t * GOLDEN) for s, t in product((-1, 1), repeat=2)]
    vertices = np.array([np.roll(corner, turn) for turn in range(3) for corner in short], float)
    faces = np.array([(a, b, c) for a in range(12) for b in range(12) for c in range(12)
                      if a < b < c and _all_near(vertices, (a, b, c))])
    inward = np.linalg.det(vertices[faces]) < 0
    faces[inward] = faces[inward][:, ::-1]
    for _ in range(detail):
        vertices, faces = subdivide(vertices, faces)
        vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices * (radius / np.linalg.norm(vertices, axis=1, keepdims=True)), faces


def _all_near(vertices: Floats, corners: tuple[int, int, int]) -> bool:
    """Whether three vertices of the icosahedron are neighbours; its edges have length 2."""
    points = vertices[list(corners)]
    return np.allclose(np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1), 2.0)


def subdivide(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Every triangle becomes four, by the midpoints of its edges; the surface stays the same."""
    ends = np.sort(sides(faces), axis=1)
    edges, number = np.unique(ends, axis=0, return_inverse=True)
    ab, bc, ca = (number.reshape(-1, 3) + len(vertices)).T
    a, b, c = faces.T
    four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return (np.concatenate([vertices, vertices[edges].mean(axis=1)]),
            np.concatenate([np.stack(corners, axis=1) for corners in four]))


def place(vertices: Floats, scale: float, degrees: tuple[float, float, float],
          position: tuple[float, float, float]) -> Floats:
    """(v, 3) vertices in the scene; `degrees` are the turns about x, y and z, in this order."""
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return (scale * (vertices - middle)) @ rotation(degrees).T + np.array(position)


def rotation(degrees: tuple[float, float, float]) -> Floats:
    """(3, 3) the matrix Rz Ry Rx."""
    total = np.eye(3)
    for axis, angle in enumerate(np.radians(degrees)):
        turn = np.eye(3)
        after, last = (axis + 1) % 3, (axis + 2) % 3
        turn[after, after] = turn[last, last] = np.cos(angle)
        turn[last, after], turn[after, last] = np.sin(angle), -np.sin(angle)
        total = turn @ total
    return total
