"""What is a mesh that can be cut?

A triangle surface in which every vertex is used, no two vertices share a place unless the surface
only touches itself there, every edge belongs to one or two triangles, every triangle has an area
and neighbours are wound alike; closed parts have their normals outwards.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from partition.graph import NO_TWIN, Ints, components, cut_apart, cut_twins, union
from partition.measure import centres, tetrahedra, triangle_areas

Floats = NDArray[np.float64]


class MeshError(Exception):
    """A mesh that cannot be used; the message is one line for the user."""


@dataclass(frozen=True)
class Mesh:
    """Vertices (v, 3), faces (f, 3), the twin (3 f,) of every side and what was repaired."""

    vertices: Floats
    faces: Ints
    twin: Ints
    repairs: tuple[str, ...] = ()

    @property
    def closed(self) -> bool:
        """Whether it has no border."""
        return not np.any(self.twin == NO_TWIN)

    @cached_property
    def components(self) -> Ints:
        """(f,) the number of the connected part that each triangle belongs to."""
        return components(len(self.faces), self.twin)

    @cached_property
    def areas(self) -> Floats:
        """(f,) of each triangle."""
        return triangle_areas(self.vertices, self.faces)

    @cached_property
    def centres(self) -> Floats:
        """(f, 3) the middle of each triangle."""
        return centres(self.vertices, self.faces)

    @property
    def borders(self) -> int:
        """Number of closed border lines: two border edges are joined where they share a vertex."""
        edges = np.flatnonzero(self.twin == NO_TWIN)
        start = self.faces[edges // 3, edges % 3]
        end = self.faces[edges // 3, (edges + 1) % 3]
        return len(np.unique(union(len(self.vertices), start, end)[start]))

    @property
    def genus(self) -> int:
        """Number of handles of all parts, by v - e + f = 2 parts - 2 genus - borders."""
        parts = int(self.components.max()) + 1
        edges = (len(self.twin) + np.count_nonzero(self.twin == NO_TWIN)) // 2
        euler = len(self.vertices) - edges + len(self.faces)
        return int(2 * parts - self.borders - euler) // 2

    @property
    def area(self) -> float:
        """Of all triangles."""
        return float(self.areas.sum())

    @property
    def volume(self) -> float:
        """Enclosed by a closed mesh."""
        return volume(self.vertices, self.faces)

    def part(self, members: Ints) -> "Mesh":
        """Some of its triangles, in the order of their numbers, with vertices of their own."""
        chosen = np.zeros(len(self.faces), dtype=np.int64)
        chosen[members] = 1
        number = np.cumsum(chosen) - 1
        twin = cut_twins(self.twin, chosen).reshape(-1, 3)[members].ravel()
        twin = np.where(twin == NO_TWIN, NO_TWIN, 3 * number[twin // 3] + twin % 3)
        faces, original = cut_apart(self.faces[members], twin)
        return Mesh(self.vertices[original], faces, twin)

    def report(self) -> str:
        """Size, topology and repairs in a few lines."""
        parts, lines = int(self.components.max()) + 1, []
        lines.append(f"{len(self.vertices)} vertices, {len(self.faces)} triangles, {parts} "
                     f"part{'s' * (parts > 1)}, {self.borders} borders, genus {self.genus}, area "
                     f"{self.area:.4g}" + (f", volume {self.volume:.4g}" if self.closed else ""))
        return "\n".join([*lines, *(f"repaired: {repair}" for repair in self.repairs)])


def volume(vertices: Floats, faces: Ints) -> float:
    """Signed volume under the triangles, seen from the middle of the vertices."""
    return float(tetrahedra(vertices, faces, vertices.mean(axis=0)).sum())
