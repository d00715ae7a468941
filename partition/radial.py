"""What happens at an edge that more than two triangles share?

Where two solids touch along an edge, four triangles meet there. Sorted by angle around the edge,
neighbours in that order that are wound against each other with the solid between them belong to
one solid, and are joined; the solids come apart. An odd number of triangles, or winding that does
not alternate, has no such reading and is an error.
"""

import numpy as np
from numpy.typing import NDArray

from partition.graph import Ints, pairs, sides, sorted_edges
from partition.mesh import MeshError

Floats = NDArray[np.float64]


def part_edges(vertices: Floats, faces: Ints, name: str, notes: list[str]) -> Ints:
    """(3 f,) the twin of every side, NO_TWIN at a boundary; raises MeshError."""
    twin, crowded = pairs(faces, len(vertices))
    return taken_apart(vertices, faces, twin, name, notes) if crowded else twin


def taken_apart(vertices: Floats, faces: Ints, twin: Ints, name: str, notes: list[str]) -> Ints:
    """(3 f,) the twins, with those right in which more than two triangles share an edge."""
    key, order = sorted_edges(faces, len(vertices))
    first = np.flatnonzero(np.append(True, key[1:] != key[:-1]))
    count = np.diff(np.append(first, len(key)))
    edges = np.flatnonzero(count > 2)
    for edge in edges:
        around = order[first[edge]:first[edge] + count[edge]]
        for here, there in _joined(vertices, faces, around, name):
            twin[here], twin[there] = there, here
    notes.append(f"{len(edges)} edges with more than two triangles taken apart")
    return twin


def _joined(vertices: Floats, faces: Ints, around: Ints, name: str) -> list[tuple[int, int]]:
    """Pairs of the sides `around` one edge that bound the same solid."""
    ends = sides(faces[around // 3]).reshape(-1, 3, 2)[np.arange(len(around)), around % 3]
    low, high = sorted(ends[0])
    axis = vertices[high] - vertices[low]
    apex = vertices[faces[around // 3, (around + 2) % 3]] - vertices[low]
    apex = apex - np.outer(apex @ axis / (axis @ axis), axis)
    across = np.cross(axis, apex[0])
    angle = np.arctan2(apex @ across / np.linalg.norm(axis), apex @ apex[0])
    turn = np.argsort(np.mod(angle, 2 * np.pi), kind="stable")
    upward = ends[turn, 0] == low
    if len(around) % 2 or np.any(upward == np.roll(upward, 1)):
        raise MeshError(f"{name}: {len(around)} triangles share the edge from "
                        f"{vertices[low].tolist()} to {vertices[high].tolist()} and bound no "
                        "solid; fix: remove the surplus triangles")
    # a side that runs up the axis has its solid clockwise of it, behind the next lower angle
    return [(int(around[turn[place]]), int(around[turn[place - 1]]))
            for place in np.flatnonzero(upward)]
