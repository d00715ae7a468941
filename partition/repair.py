"""How does a heap of triangles become a mesh that can be cut (`partition.mesh`), or an error?

In this order: indices and coordinates are checked, equal vertices welded, double and flat triangles
removed (a flat one between two others is flipped away, so that no crack opens), edges with four or
more triangles taken apart, all parts wound alike and outwards, points in which a surface merely
touches itself split, unused vertices dropped. Every repair is reported.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from partition.graph import NO_TWIN, Ints, by_number, components, pairs, separate, twins, union
from partition.mesh import Mesh, MeshError, volume
from partition.measure import tetrahedra
from partition.radial import taken_apart

Floats = NDArray[np.float64]
SMALLEST, LARGEST = 1e-60, 1e60     # areas squared and volumes stay within floating point
FLAT = 1e-14                        # area over longest edge squared
FLIP_SWEEPS = 50


def repaired(vertices: Floats, faces: Ints, name: str) -> Mesh:
    """The mesh, with what was repaired; raises MeshError."""
    return joined(*welded(vertices, faces, name), name)


def welded(vertices: Floats, faces: Ints, name: str) -> tuple[Floats, Ints, list[str]]:
    """The first half: one vertex per place, and what was repaired; raises MeshError."""
    notes: list[str] = []
    _check(vertices, faces, name)
    faces, vertices = _compact(faces, vertices)
    faces, vertices = _welded(faces, vertices, notes)
    return vertices, faces, notes


def joined(vertices: Floats, faces: Ints, notes: list[str], name: str) -> Mesh:
    """The second half: every edge between two triangles at most; raises MeshError."""
    given, (twin, crowded) = faces, pairs(faces, len(vertices))
    if crowded or _doubtful(faces, twin):
        faces = _without_doubles(faces, notes)
    faces = _without_flat(vertices, faces, notes)
    if len(faces) == 0:
        raise MeshError(f"{name}: no triangle has an area; fix: give a surface")
    if faces is not given:
        twin, crowded = pairs(faces, len(vertices))
    if crowded:
        twin = taken_apart(vertices, faces, twin, name, notes)
    faces, twin = _oriented(vertices, faces, twin, name, notes)
    faces, original = separate(faces, twin)
    touching = np.count_nonzero(original[1:] == original[:-1])
    if touching:
        notes.append(f"{touching} vertices split in which the surface touched itself")
    return Mesh(vertices[original], faces, twin, tuple(notes))


def _check(vertices: Floats, faces: Ints, name: str) -> None:
    if len(faces) == 0:
        raise MeshError(f"{name}: holds no triangles; fix: give a triangle surface")
    if faces.min() < 0 or faces.max() >= len(vertices):
        wrong = faces[(faces < 0) | (faces >= len(vertices))]
        raise MeshError(f"{name}: vertex {wrong[0]} of {len(vertices)} (counted from 0): a "
                        "triangle refers to it; fix: correct the file")
    used = np.zeros(len(vertices), dtype=bool)
    used[faces.ravel()] = True
    wild = np.flatnonzero(used & ~np.isfinite(vertices).all(axis=1))
    if len(wild):
        raise MeshError(f"{name}: vertex {wild[0]} = {vertices[wild[0]].tolist()}: not finite; "
                        "fix: correct the file")
    extent = float(np.ptp(vertices[used], axis=0).max())
    if not SMALLEST < max(extent, float(abs(vertices[used]).max())) < LARGEST:
        raise MeshError(f"{name}: extent = {extent:g}: beyond {SMALLEST:g} ... {LARGEST:g}; fix: "
                        "scale it")


def _compact(faces: Ints, vertices: Floats) -> tuple[Ints, Floats]:
    """Drop unused vertices; that needs no report, they are no part of a surface."""
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    return (np.cumsum(used) - 1)[faces], vertices[used]


def _welded(faces: Ints, vertices: Floats, notes: list[str]) -> tuple[Ints, Floats]:
    """One vertex per place."""
    vertices = vertices + 0.0       # -0 and 0 are one place
    order = _of_one_x(vertices[:, 0])
    order = order[np.lexsort(vertices[order].T)]
    new = np.ones(len(order), dtype=bool)
    new[1:] = np.any(vertices[order][1:] != vertices[order][:-1], axis=1)
    if new.all():
        return faces, vertices
    # the first of equal vertices stands for them, so that the order of the file is kept
    first = np.minimum.reduceat(order, np.flatnonzero(new))
    keep = np.ones(len(vertices), dtype=bool)
    keep[order] = False
    keep[first] = True
    number = np.arange(len(vertices))
    number[order] = first[np.cumsum(new) - 1]
    notes.append(f"{len(order) - len(first)} vertices welded to others at the same place")
    return (np.cumsum(keep) - 1)[number[faces]], vertices[keep]


def _of_one_x(x: Floats) -> Ints:
    """The vertices that share their x (v,) with another: no others can be equal, and they are few
    where the surface is not aligned with the axes."""
    order = np.argsort(x, kind="stable")
    same = x[order][1:] == x[order][:-1]
    shared = np.zeros(len(x), dtype=bool)
    shared[1:] = same
    shared[:-1] |= same
    chosen: Ints = order[shared]
    return chosen


@njit(cache=True)
def _doubtful(faces: Ints, twin: Ints) -> bool:
    """Whether a triangle has a repeated corner, or may be given twice: then the other one is across
    each of its edges, unless more than two share one."""
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if a == b or b == c or c == a:
            return True
        if twin[3 * f] != NO_TWIN and twin[3 * f] // 3 == twin[3 * f + 1] // 3:
            return True
    return False


def _without_doubles(faces: Ints, notes: list[str]) -> Ints:
    """Each set of three different vertices once."""
    a, b, c = np.ascontiguousarray(np.sort(faces, axis=1).T)
    order, count = np.arange(len(faces)), int(c.max()) + 1
    for corner in (c, b, a):
        order = by_number(corner, order, count)
    keep = np.ones(len(faces), dtype=bool)
    same = (a[order][1:] == a[order][:-1]) & (b[order][1:] == b[order][:-1]) \
        & (c[order][1:] == c[order][:-1])
    keep[order[1:][same]] = False
    collapsed = (a == b) | (b == c)
    if np.any(collapsed):
        notes.append(f"{np.count_nonzero(collapsed)} triangles with a repeated corner removed")
    double = ~keep & ~collapsed
    if np.any(double):
        notes.append(f"{np.count_nonzero(double)} triangles given twice removed")
    return faces[keep & ~collapsed]


def _without_flat(vertices: Floats, faces: Ints, notes: list[str]) -> Ints:
    """Flip the longest edge of flat triangles; remove those that have nothing behind it."""
    flat = _flat(vertices, faces)
    if np.any(flat):
        notes.append(f"{np.count_nonzero(flat)} flat triangles flipped away or removed")
    for _ in range(FLIP_SWEEPS):
        if not np.any(flat):
            return faces
        try:
            twin = twins(faces)
        except ValueError:      # which of several neighbours to flip with is not known
            break
        faces = _flip(vertices, faces, twin, np.flatnonzero(flat))
        flat = _flat(vertices, faces)
    return faces[~flat]


@njit(cache=True)
def _flat(vertices: Floats, faces: Ints) -> NDArray[np.bool_]:
    """(f,) whether a triangle has no area, compared with its longest edge."""
    flat = np.empty(len(faces), dtype=np.bool_)
    for f in range(len(faces)):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        longest, square = 0.0, 0.0
        for p, q in ((a, b), (b, c), (c, a)):
            longest = max(longest, (p[0] - q[0])**2 + (p[1] - q[1])**2 + (p[2] - q[2])**2)
        for x, y in ((0, 1), (1, 2), (2, 0)):
            square += ((b[x] - a[x]) * (c[y] - a[y]) - (b[y] - a[y]) * (c[x] - a[x]))**2 / 4
        flat[f] = square <= (FLAT * longest)**2
    return flat


def _flip(vertices: Floats, faces: Ints, twin: Ints, flat: Ints) -> Ints:
    """One sweep over the flat triangles; a triangle takes part in one flip at most."""
    faces = faces.copy()
    kept = np.ones(len(faces), dtype=bool)
    busy: set[int] = set()
    for triangle in flat:
        corners = vertices[faces[triangle]]
        length = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        side = int(np.argmax(length))
        across = twin[3 * triangle + side]
        if triangle in busy or across != NO_TWIN and across // 3 in busy:
            continue
        middle = faces[triangle, (side + 2) % 3]
        if across == NO_TWIN:
            kept[triangle] = False
            continue
        other = across // 3
        busy |= {int(triangle), int(other)}
        start, end = faces[other, across % 3], faces[other, (across + 1) % 3]
        apex = faces[other, (across + 2) % 3]
        if apex == middle:      # two flat triangles back to back
            kept[[triangle, other]] = False
            continue
        faces[other] = (start, middle, apex)
        faces[triangle] = (middle, end, apex)
    return faces[kept]


def _oriented(vertices: Floats, faces: Ints, twin: Ints, name: str,
              notes: list[str]) -> tuple[Ints, Ints]:
    """Wind neighbours alike, closed parts outwards; raises MeshError on a one-sided surface."""
    consistent = _wound_alike(faces, twin)
    if consistent and twin.min() != NO_TWIN and volume(vertices, faces) >= 0:
        return faces, twin      # nothing to do, as with most files
    count = len(faces)
    turned = np.zeros(count, dtype=bool)
    part = components(count, twin)
    if not consistent:
        inner = np.flatnonzero(twin > np.arange(len(twin)))     # each inner edge once
        start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        alike = start[inner] == end[twin[inner]]
        # node t: triangle t as it is, node t + count: turned over
        here, there = inner // 3, twin[inner] // 3
        same = union(2 * count, np.concatenate([here, here + count]),
                     np.concatenate([np.where(alike, there, there + count),
                                     np.where(alike, there + count, there)]))
        if np.any(same[:count] == same[count:]):
            raise MeshError(f"{name}: a part is one-sided like a Möbius strip; fix: cut it open")
        # of the two ways to wind a part, the one that turns fewer triangles; ties: the first kept
        over = same[:count] > same[count:]
        share = np.bincount(part, over) / np.bincount(part)
        turned = over ^ (share > 0.5)[part]
        notes.append(f"{np.count_nonzero(turned)} triangles turned over to be wound like the rest")
    faces, twin = _turn(faces, twin, turned)
    inward = _inward(vertices, faces, twin, part, consistent)
    if np.any(inward):
        notes.append(f"{np.count_nonzero(np.bincount(part, inward))} parts turned outside out")
    return _turn(faces, twin, inward)


@njit(cache=True)
def _wound_alike(faces: Ints, twin: Ints) -> bool:
    """Whether neighbours walk every common edge in opposite directions."""
    for side in range(len(twin)):
        other = twin[side]
        if other > side and faces[side // 3, side % 3] != faces[other // 3, (other + 1) % 3]:
            return False
    return True


def _inward(vertices: Floats, faces: Ints, twin: Ints, part: Ints,
            consistent: bool) -> NDArray[np.bool_]:
    """Triangles of closed parts that enclose a negative volume. A file that was wound alike is
    judged as a whole, because its negative parts may be meant as cavities."""
    bordered = np.zeros(int(part.max()) + 1, dtype=bool)
    bordered[part[np.flatnonzero(twin == NO_TWIN) // 3]] = True
    closed = ~bordered[part]
    if consistent:
        return closed & (np.any(closed) and volume(vertices, faces[closed]) < 0)
    each = np.bincount(part, tetrahedra(vertices, faces, vertices.mean(axis=0)))
    return closed & (each[part] < 0)


def _turn(faces: Ints, twin: Ints, turned: NDArray[np.bool_]) -> tuple[Ints, Ints]:
    """Reverse some triangles; side s of a reversed triangle was its side 2 - s - 1 (mod 3)."""
    if not np.any(turned):
        return faces, twin
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    sides_now = np.where(turned[:, None], np.array([1, 0, 2]), np.array([0, 1, 2]))
    where = (3 * np.arange(len(faces))[:, None] + sides_now).ravel()    # old side of each new one
    return faces, np.where(twin[where] == NO_TWIN, NO_TWIN, where[twin[where]])
