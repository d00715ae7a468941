"""Which triangles touch which, and where does one surface end?

The triangles of a mesh are the nodes of its dual graph; two are joined where they share an edge.
Side s of triangle t runs from corner s to corner s + 1 (mod 3) and has the number 3 t + s; its
twin is the same edge as the neighbouring triangle walks it, in the opposite direction if the two
are wound alike.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Ints = NDArray[np.int64]
NO_TWIN = -1


def sides(faces: Ints) -> Ints:
    """(3 f, 2) the end vertices of every side, in the direction in which its triangle walks it."""
    return np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)


def twins(faces: Ints) -> Ints:
    """(3 f,) the twin of every side, NO_TWIN at a boundary.

    Raises ValueError where more than two triangles share an edge.
    """
    key, order = sorted_edges(faces, int(faces.max(initial=0)) + 1)
    same = key[1:] == key[:-1]
    if np.any(same[1:] & same[:-1]):
        raise ValueError("an edge is shared by more than two triangles")
    twin = np.full(len(order), NO_TWIN, dtype=np.int64)
    first, second = order[:-1][same], order[1:][same]
    twin[first], twin[second] = second, first
    return twin


@njit(cache=True)
def sorted_edges(faces: Ints, count: int) -> tuple[Ints, Ints]:
    """A number (3 f,) of the edge that each side is, ascending, and the sides in that order; equal
    ones in theirs. `count` is that of the vertices."""
    low, high = np.empty(3 * len(faces), dtype=np.int64), np.empty(3 * len(faces), dtype=np.int64)
    for f in range(len(faces)):
        for s in range(3):
            start, end = faces[f, s], faces[f, (s + 1) % 3]
            low[3 * f + s], high[3 * f + s] = min(start, end), max(start, end)
    order = by_number(low, by_number(high, np.arange(len(low)), count), count)
    return low[order] * count + high[order], order


@njit(cache=True)
def by_number(key: Ints, order: Ints, count: int) -> Ints:
    """(n,) items in the order of their keys below `count`, ties as they stand in `order`: as by
    numpy's argsort, but by counting, several times faster."""
    place = np.zeros(count + 1, dtype=np.int64)
    for item in order:
        place[key[item] + 1] += 1
    place = np.cumsum(place)
    ranked = np.empty(len(order), dtype=np.int64)
    for item in order:
        ranked[place[key[item]]] = item
        place[key[item]] += 1
    return ranked


def neighbours(twin: Ints) -> Ints:
    """(f, 3) the triangle across each side, NO_TWIN at a boundary."""
    return np.where(twin == NO_TWIN, NO_TWIN, twin // 3).reshape(-1, 3)


def components(count: int, twin: Ints) -> Ints:
    """(f,) the number of the edge-connected component that each of `count` triangles belongs to."""
    inner = np.flatnonzero(twin > np.arange(len(twin)))     # each edge once
    return numbered(union(count, inner // 3, twin[inner] // 3))


def numbered(name: Ints) -> Ints:
    """Names 0, 1, ... in the order in which they first occur, for names that are the first index
    of those that bear them (as from `union`)."""
    first = name == np.arange(len(name))
    rank: Ints = (np.cumsum(first) - 1)[name]
    return rank


@njit(cache=True)
def union(count: int, a: Ints, b: Ints) -> Ints:
    """(count,) the lowest member of the set of each item after joining a[i] with b[i]."""
    root = np.arange(count)
    for i in range(len(a)):
        x, y = a[i], b[i]
        while root[x] != x:
            root[x] = root[root[x]]
            x = root[x]
        while root[y] != y:
            root[y] = root[root[y]]
            y = root[y]
        if x < y:
            root[y] = x
        else:
            root[x] = y
    for i in range(count):
        root[i] = root[root[i]]
    return root


def separate(faces: Ints, twin: Ints) -> tuple[Ints, Ints]:
    """Give every fan of triangles around a vertex a vertex of its own.

    Only triangles that are joined by a twin keep a common vertex, so surfaces that touch in a
    point, or whose twins were cut, come apart. Returns the new faces (f, 3) and, for every new
    vertex, the old one it copies (nv,); new vertices are sorted by old one.
    """
    flat = faces.ravel()
    fan = union(flat.size, *_same_corners(flat, twin))
    first = np.flatnonzero(fan == np.arange(flat.size))
    order = np.argsort(flat[first], kind="stable")
    rank = np.empty(flat.size, dtype=np.int64)
    rank[first[order]] = np.arange(len(first))
    return rank[fan].reshape(-1, 3), flat[first[order]]


@njit(cache=True)
def _same_corners(flat: Ints, twin: Ints) -> tuple[Ints, Ints]:
    """Pairs of corners, two at each inner edge, that are one vertex; corners are numbered as in
    `flat`, the faces (3 f,) one after the other."""
    one, two = np.empty(len(twin), dtype=np.int64), np.empty(len(twin), dtype=np.int64)
    count = 0
    for side in range(len(twin)):
        other = twin[side]
        if other <= side:       # a border, or done
            continue
        end, other_end = side - side % 3 + (side + 1) % 3, other - other % 3 + (other + 1) % 3
        alike = flat[side] == flat[other_end]
        one[count], two[count] = side, other_end if alike else other
        one[count + 1], two[count + 1] = end, other if alike else other_end
        count += 2
    return one[:count], two[:count]


def cut_twins(twin: Ints, label: Ints) -> Ints:
    """The twins that remain when the surface is cut where `label` (f,) changes."""
    triangle = np.arange(len(twin)) // 3
    keep = (twin != NO_TWIN) & (label[triangle] == label[twin // 3])
    return np.where(keep, twin, NO_TWIN)
