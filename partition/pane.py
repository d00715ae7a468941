"""Where do the points of a pane of glass lie?

The corners of its outline (a rectangle, or any convex polygon), points along the edges about as
far apart as those inside, and points inside: together exactly as many as asked for.

random   uniform
even     each the farthest from all others of some random candidates (Mitchell 1991): no clusters
radial   around the point of impact, at distances R u^2 for uniform u: fine there, coarse far away

All come from one random stream, so a pane depends on nothing but its outline and the seed.
"""

import numpy as np
from numpy.typing import NDArray

from partition.triangulate import TriangulationError, hull, orientation

Floats = NDArray[np.float64]
EDGE_DENSITY = 0.7      # edge points per mean distance between points
JITTER = 0.3            # of an edge point, in its spacing
CANDIDATES = 12         # per even point


def pane_points(outline: Floats, count: int, rng: np.random.Generator, sampling: str = "random",
                impact: tuple[float, float] = (0.0, 0.0)) -> Floats:
    """(count, 2) distinct points of a convex polygon (m, 2), its corners first; count >= m."""
    corners = _counter_clockwise(outline)
    if count < len(corners):
        raise TriangulationError(f"points = {count}: fewer than the {len(corners)} corners; fix: "
                                 "give more")
    spacing = np.sqrt(_area(corners) / count)
    edges = [_edge(start, end, spacing, rng)
             for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    border = np.concatenate([corners, *edges])[:count]
    wanted = count - len(border)
    if sampling == "even":
        return _evenly(corners, border, wanted, rng)
    if sampling == "radial":
        return np.concatenate([border, _around(corners, np.array(impact), wanted, rng)])
    return np.concatenate([border, _uniform(corners, wanted, rng)])


def rectangle(width: float, height: float) -> Floats:
    """(4, 2) corners, the middle at the origin."""
    half = np.array([width, height]) / 2
    return half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])


def _counter_clockwise(outline: Floats) -> Floats:
    corners = hull(outline)
    if len(corners) < len(outline):
        raise TriangulationError("outline: not a convex polygon of distinct corners; fix: leave "
                                 "out the corners that point inwards")
    return outline[corners]


def _area(corners: Floats) -> float:
    x, y = corners.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def _edge(start: Floats, end: Floats, spacing: float, rng: np.random.Generator) -> Floats:
    """Jittered points between two corners; a coordinate that both share is kept exactly, and on a
    slanting edge rounding may leave the outline a little concave, never overlapping."""
    count = int(EDGE_DENSITY * np.linalg.norm(end - start) / spacing)
    even = np.arange(1, count + 1) + rng.uniform(-JITTER, JITTER, count)
    along = (even / (count + 1))[:, None]
    return np.where(start == end, start, start + along * (end - start))


def _inside(points: Floats, corners: Floats) -> NDArray[np.bool_]:
    """(n,) strictly inside a convex polygon."""
    m = len(corners)
    everything = np.concatenate([corners, points])
    side = np.arange(m)[:, None]
    turns = orientation(everything, side, (side + 1) % m, m + np.arange(len(points))[None, :])
    inside: NDArray[np.bool_] = np.all(turns > 0, axis=0)
    return inside


def _uniform(corners: Floats, count: int, rng: np.random.Generator) -> Floats:
    """By rejection from the bounding box."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    found = np.empty((0, 2))
    while len(found) < count:
        tried = rng.uniform(low, high, (2 * count, 2))
        found = np.concatenate([found, tried[_inside(tried, corners)]])
    return found[:count]


def _evenly(corners: Floats, border: Floats, count: int, rng: np.random.Generator) -> Floats:
    """The border and `count` points more, each the best of its candidates."""
    points = np.concatenate([border, np.empty((count, 2))])
    candidates = _uniform(corners, CANDIDATES * count, rng).reshape(count, CANDIDATES, 2)
    for place, some in enumerate(candidates, start=len(border)):
        gap = ((some[:, None, :] - points[None, :place, :])**2).sum(axis=2).min(axis=1)
        points[place] = some[np.argmax(gap)]
    return points


def _around(corners: Floats, impact: Floats, count: int, rng: np.random.Generator) -> Floats:
    """Graded towards the impact, wherever in the plane that is."""
    reach = np.linalg.norm(corners - impact, axis=1).max()
    found = np.empty((0, 2))
    while len(found) < count:
        radius = reach * rng.uniform(0, 1, 4 * count)**2
        angle = rng.uniform(0, 2 * np.pi, 4 * count)
        tried = impact + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        found = np.concatenate([found, tried[_inside(tried, corners)]])
    return found[:count]
