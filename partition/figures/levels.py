"""What do the first two cuts of a breadth-first search do? (thesis, figures 4.1 and 4.2)

The thesis lists triangles by levels, a child sharing a vertex with its parent, and cuts between
levels floor(max / 2) and the next. The second cut may give a part that does not hang together; what
a search of it does not reach is lost. Beside it, the cuts of `partition.bfs`.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from partition.bfs import break_up
from partition.figures import paper
from partition.graph import Ints, components, cut_twins, neighbours, twins
from partition.measure import triangle_areas
from partition.pane import pane_points, rectangle
from partition.triangulate import delaunay

Floats = NDArray[np.float64]
POINTS, SEED = 44, 1


def draw(path: str | Path) -> list[str]:
    """The picture; what there is to count in it."""
    points = pane_points(rectangle(1.0, 1.0), POINTS, np.random.default_rng(SEED), "even")
    faces = delaunay(points)
    twin = twins(faces)
    start = np.linalg.norm(points[faces].mean(axis=1) - (-0.5, 0.5), axis=1)
    first = levels(faces, int(np.argmin(start)))
    half = np.where(first <= first.max() // 2, 0, 1)
    mine = np.flatnonzero(half == 1)
    second = np.full(len(faces), -1)
    places = points[faces[mine]].mean(axis=1)
    middle = np.linalg.norm(places - places.mean(axis=0), axis=1)
    second[mine] = levels(faces[mine], int(np.argmin(middle)))
    quarter = np.where(half == 0, 0, np.where(second <= second.max() // 2, 1, 2))
    area = triangle_areas(np.column_stack([points, np.zeros(len(points))]), faces)
    ours = break_up(neighbours(twin), area, 4, components(len(faces), twin), start)

    made, panels = paper.figure(12.0, 4.5, 3)
    shown = [(half, first, "first cut: levels, L = %d" % (first.max() // 2)),
             (quarter, second, "second cut, from the middle of the right part: L = %d"
              % (second.max() // 2)),
             (ours, None, "four pieces of partition.bfs")]
    for axes, (label, level, title) in zip(panels, shown, strict=True):
        paper.triangles(axes, points, faces, label)
        paper.cuts(axes, points, faces, twin, label)
        if level is not None:
            _numbers(axes, points, faces, level)
        paper.bare(axes, title)
    paper.save(made, path)
    torn = _parts(faces, twin, quarter)
    return [f"first cut: {np.count_nonzero(half == 0)} + {len(mine)} triangles, "
            f"{first.max() + 1} levels",
            f"second cut: {np.count_nonzero(quarter == 1)} + {np.count_nonzero(quarter == 2)} "
            f"triangles in {torn[1]} + {torn[2]} edge-connected parts",
            f"partition.bfs: {', '.join(map(str, np.bincount(ours)))} triangles in "
            f"{', '.join(map(str, _parts(faces, twin, ours)))} parts, areas within "
            f"{abs(np.bincount(ours, area) / area.sum() * 4 - 1).max():.0%} of a quarter"]


def levels(faces: Ints, root: int) -> Ints:
    """(f,) steps from the root over shared vertices; -1 where it does not reach."""
    count = len(faces)
    corner = csr_array((np.ones(3 * count), (np.repeat(np.arange(count), 3), faces.ravel())))
    steps = dijkstra(corner @ corner.T, indices=root, unweighted=True)
    return np.where(np.isfinite(steps), steps, -1).astype(np.int64)


def _parts(faces: Ints, twin: Ints, label: Ints) -> list[int]:
    """Edge-connected parts of each piece."""
    part = components(len(faces), cut_twins(twin, label))
    return [len(np.unique(part[label == piece])) for piece in range(int(label.max()) + 1)]


def _numbers(axes: Any, points: Floats, faces: Ints, level: Ints) -> None:
    for centre, number in zip(points[faces].mean(axis=1), level, strict=True):
        if number >= 0:
            axes.text(*centre, str(number), ha="center", va="center", fontsize=7, color=paper.INK)
