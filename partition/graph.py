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
    twin, crowded = pairs(faces, int(faces.max(initial=-1)) + 1)
    if crowded:
        raise ValueError("an edge is shared by more than two triangles")
    return twin


@njit(cache=True)
def pairs(faces: Ints, count: int) -> tuple[Ints, bool]:
    """(3 f,) the other side along the same edge, NO_TWIN where there is none, and whether there is
    more than one somewhere. `count` is that of the vertices.

    Sides are sorted, by counting, by the lower end of their edge; two of one lower end are the same
    edge if they meet at the same upper end.
    """
    start = np.zeros(count + 1, dtype=np.int64)
    for f in range(len(faces)):
        for s in range(3):
            start[min(faces[f, s], faces[f, (s + 1) % 3]) + 1] += 1
    start = np.cumsum(start)
    place, by_lower = start[:-1].copy(), np.empty(3 * len(faces), dtype=np.int64)
    for f in range(len(faces)):
        for s in range(3):
            low = min(faces[f, s], faces[f, (s + 1) % 3])
            by_lower[place[low]] = 3 * f + s
            place[low] += 1
    twin = np.full(3 * len(faces), NO_TWIN, dtype=np.int64)
    met, by = np.full(count, -1, dtype=np.int64), np.empty(count, dtype=np.int64)
    crowded = False
    for low in range(count):
        for k in range(start[low], start[low + 1]):
            side = by_lower[k]
            f, s = side // 3, side % 3
            high = max(faces[f, s], faces[f, (s + 1) % 3])
            if met[high] != low:
                met[high], by[high] = low, side
            elif twin[by[high]] == NO_TWIN:
                twin[side], twin[by[high]] = by[high], side
            else:
                crowded = True
    return twin, crowded


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


@njit(cache=True)
def components(count: int, twin: Ints) -> Ints:
    """(f,) the number of the edge-connected component that each of `count` triangles belongs to;
    components are numbered by their first triangles."""
    part = np.full(count, -1, dtype=np.int64)
    queue, met, done, parts = np.empty(count, dtype=np.int32), 0, 0, 0
    for first in range(count):
        if part[first] >= 0:
            continue
        part[first], queue[met] = parts, first
        met += 1
        while done < met:
            f = queue[done]
            done += 1
            for side in range(3 * f, 3 * f + 3):
                if twin[side] != NO_TWIN and part[twin[side] // 3] < 0:
                    part[twin[side] // 3], queue[met] = parts, twin[side] // 3
                    met += 1
        parts += 1
    return part


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

    Only triangles that are joined by a twin, and wound alike, keep a common vertex, so surfaces
    that touch in a point come apart. Returns the new faces (f, 3) and, for every new vertex, the
    old one it copies (nv,); new vertices are sorted by old one.
    """
    return _renumbered(faces, twin, np.ones(int(faces.max(initial=-1)) + 1, dtype=np.bool_))


def cut_apart(faces: Ints, twin: Ints) -> tuple[Ints, Ints]:
    """The same for a surface that was cut: only vertices on a border can have several fans."""
    return _renumbered(faces, twin, _on_border(faces, twin, int(faces.max(initial=-1)) + 1))


def _renumbered(faces: Ints, twin: Ints, several: NDArray[np.bool_]) -> tuple[Ints, Ints]:
    fan, fans = _fans(faces, twin, several)
    first = np.cumsum(fans) - fans
    return first[faces] + fan.reshape(-1, 3), np.repeat(np.arange(len(fans)), fans)


@njit(cache=True)
def _on_border(faces: Ints, twin: Ints, count: int) -> NDArray[np.bool_]:
    """(count,) whether a side without twin begins or ends in each vertex."""
    border = np.zeros(count, dtype=np.bool_)
    for side in range(len(twin)):
        if twin[side] == NO_TWIN:
            border[faces[side // 3, side % 3]] = border[faces[side // 3, (side + 1) % 3]] = True
    return border


@njit(cache=True)
def _fans(faces: Ints, twin: Ints, several: NDArray[np.bool_]) -> tuple[Ints, Ints]:
    """(3 f,) which of the fans of its vertex each corner belongs to, and how many (v,) each vertex
    has; it is looked at only where it may have `several` (v,)."""
    fan, fans = np.full(len(twin), -1, dtype=np.int64), np.zeros(len(several), dtype=np.int64)
    for corner in range(len(twin)):
        vertex = faces[corner // 3, corner % 3]
        if fan[corner] >= 0:
            continue
        if not several[vertex]:
            fan[corner], fans[vertex] = 0, 1
            continue
        here, number = corner, fans[vertex]
        while here != NO_TWIN and fan[here] < 0:        # across the side that ends in the vertex
            fan[here] = number
            here = twin[_before(here)]
        here = twin[corner]
        while here != NO_TWIN and fan[_after(here)] < 0:    # up to a border, the other way
            fan[_after(here)] = number
            here = twin[_after(here)]
        fans[vertex] += 1
    return fan, fans


@njit(inline="always")
def _after(side: int) -> int:
    """The next side of the same triangle."""
    return side - 2 if side % 3 == 2 else side + 1


@njit(inline="always")
def _before(side: int) -> int:
    return side + 2 if side % 3 == 0 else side - 1


@njit(cache=True)
def cut_twins(twin: Ints, label: Ints) -> Ints:
    """The twins that remain when the surface is cut where `label` (f,) changes."""
    kept = twin.copy()
    for side in range(len(twin)):
        if twin[side] != NO_TWIN and label[side // 3] != label[twin[side] // 3]:
            kept[side] = NO_TWIN
    return kept
