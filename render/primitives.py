"""Where does a ray meet a box, a sphere or a plane? Exact intersections, no meshes.

Table of m primitives, `data` (m, 6):
    box     low corner, high corner: the slabs; a ray that starts inside meets its far side
    sphere  centre, radius: t = -b ± sqrt(b² - c), b = (o - centre)·d, c = |o - centre|² - r²
    plane   point, unit normal
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from render.kernel import kernel
from render.rays import Hits, Rays
from render.vector import Three, along, dot, load, unit
from solver.scene_render import Thing

BOX, SPHERE, PLANE = 0, 1, 2
Array = NDArray[np.float64]


class Primitives(NamedTuple):
    """kind (m,), data (m, 6) as above, material (m,)"""

    kind: NDArray[np.int64]
    data: Array
    material: NDArray[np.int64]


def primitives(things: Sequence[Thing], material: dict[str, int]) -> Primitives:
    """The table of all objects that are not meshes."""
    rows = [(kind, data, material[thing.material])
            for thing in things for kind, data in _parts(thing)]
    return Primitives(np.array([row[0] for row in rows], np.int64),
                      np.array([row[1] for row in rows], np.float64).reshape(-1, 6),
                      np.array([row[2] for row in rows], np.int64))


def _parts(thing: Thing) -> Iterator[tuple[int, tuple[float, ...]]]:
    if thing.shape == "box":
        yield BOX, (*thing.low, *thing.high)
    elif thing.shape == "frame":
        yield from ((BOX, corners) for corners in frame_boxes(thing))
    elif thing.shape == "sphere":
        yield SPHERE, (*thing.place, thing.radius, 0.0, 0.0)
    elif thing.shape == "plane":
        length = np.linalg.norm(thing.normal)
        yield PLANE, (*thing.place, *(float(x / length) for x in thing.normal))


def frame_boxes(thing: Thing) -> Iterator[tuple[float, ...]]:
    """A box with a hole along its thinnest axis, as four boxes around the hole."""
    low, high = np.array(thing.low), np.array(thing.high)
    a, b = (axis for axis in range(3) if axis != int(np.argmin(high - low)))
    hole_low = np.clip(thing.hole_low, low, high)
    hole_high = np.clip(thing.hole_high, low, high)
    for axis, side in ((a, 0), (a, 1), (b, 0), (b, 1)):
        corners = [low.copy(), high.copy()]
        corners[1 - side][axis] = (hole_low, hole_high)[side][axis]
        if axis == b:   # between the two boxes that take the whole height
            corners[0][a], corners[1][a] = hole_low[a], hole_high[a]
        if np.all(corners[1] > corners[0]):
            yield (*corners[0], *corners[1])


@kernel
def meet(table: Primitives, first: int, rays: Rays, hits: Hits) -> None:
    """Replace hits by nearer ones on primitives; primitive k is surface `first` + k."""
    for ray in range(rays.pixel.size):
        o, d = load(rays.origin, ray), load(rays.direction, ray)
        for k in range(table.kind.size):
            t = distance(table, k, o, d)
            if t < hits.distance[ray]:
                hits.distance[ray] = t
                hits.surface[ray] = first + k


@kernel
def distance(table: Primitives, k: int, o: Three, d: Three) -> float:
    """The smallest positive distance to primitive k along o + t d, |d| = 1; inf for none."""
    if table.kind[k] == BOX:
        return _box(table.data[k], o, d)
    if table.kind[k] == SPHERE:
        return _sphere(table.data[k], o, d)
    n = (table.data[k, 3], table.data[k, 4], table.data[k, 5])
    slope = dot(n, d)
    lift = dot(n, along((table.data[k, 0], table.data[k, 1], table.data[k, 2]), -1.0, o))
    return lift / slope if slope != 0.0 and lift / slope > 0.0 else np.inf


@kernel
def slabs(low: Three, high: Three, o: Three, d: Three) -> tuple[float, float]:
    """Distances at which a line enters and leaves a box; enters > leaves: it misses."""
    enter, leave = -np.inf, np.inf
    for axis in range(3):
        if d[axis] == 0.0:
            if o[axis] < low[axis] or o[axis] > high[axis]:
                return np.inf, -np.inf
            continue
        inverse = 1.0 / d[axis]
        a, b = (low[axis] - o[axis]) * inverse, (high[axis] - o[axis]) * inverse
        enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    return enter, leave


@kernel
def _box(data: Array, o: Three, d: Three) -> float:
    enter, leave = slabs((data[0], data[1], data[2]), (data[3], data[4], data[5]), o, d)
    if enter > leave or leave <= 0.0:
        return np.inf
    return enter if enter > 0.0 else leave


@kernel
def _sphere(data: Array, o: Three, d: Three) -> float:
    p = (o[0] - data[0], o[1] - data[1], o[2] - data[2])
    b = dot(p, d)
    # |p - b d|² is the squared distance of the line from the centre: no cancellation far away
    q = along(p, -b, d)
    radicand = data[3] * data[3] - dot(q, q)
    if radicand < 0.0:
        return np.inf
    root = np.sqrt(radicand)
    if -b - root > 0.0:
        return -b - root
    return -b + root if -b + root > 0.0 else np.inf


@kernel
def normal_at(table: Primitives, k: int, p: Three) -> Three:
    """The outward unit normal of primitive k at its surface point p."""
    data = table.data[k]
    if table.kind[k] == SPHERE:
        return unit((p[0] - data[0], p[1] - data[1], p[2] - data[2]))
    if table.kind[k] == PLANE:
        return data[3], data[4], data[5]
    axis, side, nearest = 0, 1.0, np.inf
    for a in range(3):
        for s in range(2):
            gap = abs(p[a] - data[a + 3 * s])
            if gap < nearest:
                axis, side, nearest = a, 2.0 * s - 1.0, gap
    return (side if axis == 0 else 0.0, side if axis == 1 else 0.0, side if axis == 2 else 0.0)
