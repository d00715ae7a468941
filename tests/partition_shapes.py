"""Surfaces on which it is known where they come apart."""

import numpy as np
from numpy.typing import NDArray

from partition.animal import rounded_cone, smooth_minimum
from partition.graph import Ints
from partition.isosurface import surface_net
from partition.mesh import Mesh
from partition.repair import repaired

Floats = NDArray[np.float64]


def octahedron() -> Mesh:
    """The thesis' example (4.2.2): a square of side 1 with an apex at height 1 on either side."""
    vertices = np.array([(0.5, 0.5, 0), (-0.5, 0.5, 0), (0, 0, 1), (-0.5, -0.5, 0),
                         (0.5, -0.5, 0), (0, 0, -1)])
    ring = [0, 1, 3, 4]
    around = list(zip(ring, ring[1:] + ring[:1], strict=True))
    return repaired(vertices, np.array([(a, b, 2) for a, b in around]
                                       + [(b, a, 5) for a, b in around]), "octahedron")


def dumb_bell(spacing: float = 0.1) -> Mesh:
    """Balls of radius 0.5 and 0.4 around x = -0.7 and 0.7, joined by a neck of radius 0.15."""
    def f(points: Floats) -> Floats:
        balls = np.minimum(np.linalg.norm(points + (0.7, 0, 0), axis=1) - 0.5,
                           np.linalg.norm(points - (0.7, 0, 0), axis=1) - 0.4)
        neck = rounded_cone(points, (-0.7, 0, 0), (0.7, 0, 0), 0.15, 0.15)
        return smooth_minimum(balls, neck, 0.1)
    return repaired(*surface_net(f, np.array([-1.4, -0.7, -0.7]), np.array([1.4, 0.7, 0.7]),
                                 spacing), "dumb-bell")


def lopsided() -> Mesh:
    """A dumb-bell without any symmetry."""
    bell = dumb_bell()
    x, y, z = bell.vertices.T
    bent = np.stack([x + 0.2 * y * y, 0.8 * y + 0.15 * x * x, z + 0.1 * x * y], axis=1)
    noise = np.random.default_rng(6).normal(0, 0.003, bent.shape)
    return repaired(bent + noise, bell.faces, "lopsided")


def folded_sheet(degrees: float, at: float = 0.3, nx: int = 40, ny: int = 20) -> Mesh:
    """A jittered 1 x 0.5 sheet whose part x > `at` is folded up by an angle."""
    rng = np.random.default_rng(2)
    x, y = np.meshgrid(np.linspace(0, 1, nx + 1), np.linspace(0, 0.5, ny + 1), indexing="ij")
    crease = np.argmin(abs(x[:, 0] - at))
    inner = np.zeros_like(x, dtype=bool)
    inner[1:-1, 1:-1] = True
    inner[crease] = False
    x = x + inner * rng.uniform(-0.3, 0.3, x.shape) / nx
    y = y + inner * rng.uniform(-0.3, 0.3, x.shape) * 0.5 / ny
    beyond = np.maximum(x - x[crease, 0], 0)
    angle = np.radians(degrees)
    points = np.stack([np.minimum(x, x[crease, 0]) + beyond * np.cos(angle), y,
                       beyond * np.sin(angle)], axis=-1).reshape(-1, 3)
    return repaired(points, _grid(nx, ny), "sheet")


def _grid(nx: int, ny: int) -> Ints:
    corner = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    a, b, c, d = (corner[i:nx + i, j:ny + j].ravel() for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def turned(mesh: Mesh, seed: int, scale: float = 1.0) -> tuple[Mesh, Ints]:
    """The same mesh scaled, turned, moved, its vertices and faces renumbered; the old number of
    every new face."""
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    vertices = scale * (mesh.vertices @ turn.T + (7, 8, 9))
    order, faces = rng.permutation(len(vertices)), rng.permutation(len(mesh.faces))
    rank = np.argsort(order)
    rolled = [np.roll(face, shift) for face, shift in zip(rank[mesh.faces[faces]],
                                                          rng.integers(0, 3, len(faces)),
                                                          strict=True)]
    return repaired(vertices[order], np.array(rolled), "turned"), faces
