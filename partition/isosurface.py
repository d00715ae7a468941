"""How does a function of space become a closed triangle mesh?

Naive surface nets (Gibson, MICCAI 1998): sample f on a grid, put one vertex in every cell whose
corners differ in sign, join the four cells around every grid edge that changes sign by two
triangles, and let the vertices relax on the surface f = 0. The mesh is closed as long as the
surface stays inside the grid, and its triangles are better shaped than those of marching cubes.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from partition.graph import Ints, sides

Floats = NDArray[np.float64]
Function = Callable[[Floats], Floats]
NEWTON_STEPS = 3
RELAXATIONS = 8


def surface_net(f: Function, low: Floats, high: Floats, spacing: float) -> tuple[Floats, Ints]:
    """Vertices (v, 3) and faces (t, 3) of {f = 0}, outward where f > 0 is outside.

    f maps points (n, 3) to values (n,) and must be positive on the border of [low, high].
    """
    cells = np.ceil((high - low) / spacing).astype(np.int64)
    grid = np.stack(np.meshgrid(*(np.arange(n + 1) for n in cells), indexing="ij"), axis=-1)
    values = f(low + spacing * grid.reshape(-1, 3)).reshape(grid.shape[:3])
    inside = values < 0
    corners = np.stack([inside[x:x + cells[0], y:y + cells[1], z:z + cells[2]]
                        for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    active = corners.any(axis=0) & ~corners.all(axis=0)
    number = np.full(tuple(cells), -1, dtype=np.int64)
    number[active] = np.arange(np.count_nonzero(active))
    vertices = low + spacing * (np.argwhere(active) + 0.5)
    faces = np.concatenate([_faces(inside, number, axis) for axis in range(3)])
    return _relaxed(f, vertices, faces, spacing), faces


def _faces(inside: NDArray[np.bool_], number: Ints, axis: int) -> Ints:
    """Two triangles around every grid edge along `axis` whose ends differ."""
    inside = np.moveaxis(inside, axis, 0)
    number = np.moveaxis(number, axis, 0)
    if axis == 1:       # keep (axis, second, third) a right-handed order of the axes
        inside, number = inside.swapaxes(1, 2), number.swapaxes(1, 2)
    start = inside[:-1, 1:-1, 1:-1]
    edges = np.argwhere(start != inside[1:, 1:-1, 1:-1])
    i, j, k = edges[:, 0], edges[:, 1] + 1, edges[:, 2] + 1
    around = np.stack([number[i, j - 1, k - 1], number[i, j, k - 1],
                       number[i, j, k], number[i, j - 1, k]], axis=1)
    leaving = inside[i, j, k]
    around = np.where(leaving[:, None], around, around[:, ::-1])
    return np.concatenate([around[:, [0, 1, 2]], around[:, [0, 2, 3]]])


def _relaxed(f: Function, points: Floats, faces: Ints, spacing: float) -> Floats:
    """Each vertex among its neighbours and on f = 0, in turns: evenly shaped triangles."""
    ends = sides(faces)
    degree = np.bincount(ends[:, 0], minlength=len(points))[:, None]
    for _ in range(RELAXATIONS):
        around = np.stack([np.bincount(ends[:, 0], column[ends[:, 1]], len(points))
                           for column in points.T], axis=1) / degree
        points = _newton(f, around, spacing)
    return points


def _newton(f: Function, points: Floats, spacing: float) -> Floats:
    """Steps to f = 0 along the gradient (central differences), each at most half a cell long."""
    delta = 1e-4 * spacing
    for _ in range(NEWTON_STEPS):
        gradient = np.stack([(f(points + step) - f(points - step)) / (2 * delta)
                             for step in delta * np.eye(3)], axis=1)
        length = np.maximum(np.linalg.norm(gradient, axis=1), 1e-6)
        far = np.clip(f(points) / length, -spacing / 2, spacing / 2)
        points = points - gradient * (far / length)[:, None]
    return points
