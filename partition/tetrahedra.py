"""What is inside a closed surface?

Tetrahedra: of the Delaunay tetrahedra (Qhull, through scipy) of the vertices of the surface and of
a lattice of points inside, those are kept whose centre is inside. Triangles of the surface that are
no faces of tetrahedra are halved, some times over, until all are: the boundary of the tetrahedra is
the surface then, and encloses the same volume. Where that breeds ever more of them, at sharp edges
or where four points of a plane lie on a circle, some are left. The body is from then on the
tetrahedra: its surface is theirs, closed because they fill it.

Tetrahedra are the nodes of a dual graph, like triangles: two are joined where they share a face.
Face i of a tetrahedron is the one opposite corner i, counter-clockwise seen from outside.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay, cKDTree

from partition.graph import NO_TWIN, Ints, numbered, union
from partition.inside import winding
from partition.mesh import Mesh, MeshError
from partition.recover import FACES, absent, halved

Floats = NDArray[np.float64]
REFINEMENTS = 20
COARSER = 1.5           # lattice over mean edge of the surface
MOST_INNER = 30_000     # lattice cells in the bounding box
JITTER = 0.05           # of the lattice
FLAT = 1e-7             # volume over mean edge cubed


@dataclass(frozen=True)
class Tetrahedra:
    """Vertices (v, 3) and cells (t, 4) of positive volume."""

    vertices: Floats
    cells: Ints

    @cached_property
    def neighbour(self) -> Ints:
        """(t, 4) the tetrahedron behind each face, NO_TWIN on the surface."""
        key = np.sort(self.cells[:, FACES].reshape(-1, 3), axis=1)
        order = np.lexsort(key.T)
        same = np.flatnonzero((key[order][1:] == key[order][:-1]).all(axis=1))
        across = np.full(len(key), NO_TWIN, dtype=np.int64)
        across[order[same]] = order[same + 1] // 4
        across[order[same + 1]] = order[same] // 4
        return across.reshape(-1, 4)

    @cached_property
    def components(self) -> Ints:
        """(t,) the number of the connected part that each tetrahedron belongs to."""
        cell, side = np.nonzero(self.neighbour != NO_TWIN)
        return numbered(union(len(self.cells), cell, self.neighbour[cell, side]))

    @cached_property
    def volumes(self) -> Floats:
        """(t,) of each tetrahedron."""
        a, b, c, d = (self.vertices[corner] for corner in self.cells.T)
        volume: Floats = ((b - a) * np.cross(c - a, d - a)).sum(axis=1) / 6
        return volume

    @property
    def centres(self) -> Floats:
        """(t, 3) mean of the corners."""
        centre: Floats = self.vertices[self.cells].mean(axis=1)
        return centre

    def part(self, members: Ints) -> "Tetrahedra":
        """Some of the tetrahedra, with the same vertices."""
        return Tetrahedra(self.vertices, self.cells[members])

    def surface(self) -> tuple[Ints, Ints]:
        """Triangles (f, 3) of the surface and the tetrahedron (f,) behind each."""
        cell, side = np.nonzero(self.neighbour == NO_TWIN)
        return self.cells[cell[:, None], FACES[side]], cell


def fill(mesh: Mesh, name: str) -> Tetrahedra:
    """Tetrahedra inside a closed mesh; raises MeshError."""
    if not mesh.closed:
        raise MeshError(f"{name}: interior = 'solid': the surface has a border; fix: close it, or "
                        "set interior = \"shell\"")
    surface, points = mesh.faces, mesh.vertices
    edges = points[surface] - points[np.roll(surface, -1, axis=1)]
    spacing = float(np.linalg.norm(edges, axis=2).mean())
    points = np.concatenate([points, _lattice(mesh, spacing)])
    filled = Delaunay(points, incremental=True)
    fewest = 3 * len(surface)
    for _ in range(REFINEMENTS):
        split = absent(points, surface, filled.simplices)
        if not 0 < np.count_nonzero(split) < 2 * fewest:
            break
        fewest = min(fewest, np.count_nonzero(split))
        surface, ends = halved(surface, split, len(points))
        points = np.concatenate([points, points[ends].mean(axis=1)])
        filled.add_points(points[-len(ends):])
    cells = filled.simplices.astype(np.int64)
    body = _upright(points, cells, spacing)
    within = winding(body.centres, mesh.vertices, mesh.faces) > 0
    if not np.any(within):
        raise MeshError(f"{name}: interior = 'solid': nothing is inside the surface; fix: turn it "
                        "outside out")
    return body.part(np.flatnonzero(within))


def _lattice(mesh: Mesh, spacing: float) -> Floats:
    """(n, 3) jittered body-centred points inside, no nearer to a vertex than 0.6 spacings."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    step = max(COARSER * spacing, float((np.prod(high - low) / MOST_INNER) ** (1 / 3)))
    corners = np.stack(np.meshgrid(*(np.arange(a, b, step) for a, b in zip(low, high, strict=True)),
                                   indexing="ij"), axis=-1).reshape(-1, 3)
    points = np.concatenate([corners, corners + step / 2])
    points += np.random.default_rng(0).uniform(-JITTER, JITTER, points.shape) * step
    points = points[winding(points, mesh.vertices, mesh.faces) > 0]
    near, _ = cKDTree(mesh.vertices).query(points)
    return points[near > 0.6 * spacing]


def _upright(points: Floats, cells: Ints, spacing: float) -> Tetrahedra:
    """With positive volumes; flat tetrahedra are left out."""
    volume = Tetrahedra(points, cells).volumes
    cells[volume < 0] = cells[volume < 0][:, [0, 2, 1, 3]]
    return Tetrahedra(points, cells[abs(volume) > FLAT * spacing**3])
