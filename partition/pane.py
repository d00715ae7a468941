"""Where do the points of a pane of glass lie?

The four corners, points along the edges about as far apart as those inside, and random points
inside: together exactly as many as asked for. All come from one random stream, so a pane depends
on nothing but its size and the seed.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
EDGE_DENSITY = 0.7      # edge points per mean distance between points
JITTER = 0.3            # of an edge point, in its spacing


def pane_points(width: float, height: float, count: int, rng: np.random.Generator) -> Floats:
    """(count, 2) distinct points of the rectangle |x| <= width/2, |y| <= height/2; count >= 4."""
    half = np.array([width, height]) / 2
    corners = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    spacing = np.sqrt(width * height / count)
    edges = [_edge(start, end, spacing, rng)
             for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    border = np.concatenate([corners, *edges])[:count]
    inside = rng.uniform(-1, 1, (count - len(border), 2)) * half
    return np.concatenate([border, inside])


def _edge(start: Floats, end: Floats, spacing: float, rng: np.random.Generator) -> Floats:
    """Jittered points between two corners; the coordinate that both share is kept exactly."""
    count = int(EDGE_DENSITY * np.linalg.norm(end - start) / spacing)
    even = np.arange(1, count + 1) + rng.uniform(-JITTER, JITTER, count)
    along = (even / (count + 1))[:, None]
    return np.where(start == end, start, start + along * (end - start))
