"""How differently are the same points joined? (thesis, figures 3.4 to 3.6)"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Voronoi

from partition.figures import paper
from partition.graph import NO_TWIN, Ints, sides, twins
from partition.pane import pane_points, rectangle
from partition.triangulate import delaunay, trisection

Floats = NDArray[np.float64]
POINTS, SEED = 200, 4


def draw(path: str | Path) -> list[str]:
    """The picture; what there is to count and measure in it."""
    points = pane_points(rectangle(1.0, 1.0), POINTS, np.random.default_rng(SEED))
    made, (left, middle, right) = paper.figure(12.0, 4.4, 3)
    joined = {"trisection": trisection(points), "Delaunay": delaunay(points)}
    for axes, (name, faces) in zip((left, right), joined.items(), strict=True):
        paper.triangles(axes, points, faces)
        paper.bare(axes, f"{name}: {len(faces)} triangles")
    _regions(middle, points)
    paper.bare(middle, "Voronoi regions")
    for axes in (left, middle, right):
        axes.plot(*points.T, ".", color=paper.INK, markersize=3)
        axes.set_xlim(-0.52, 0.52)
        axes.set_ylim(-0.52, 0.52)
    paper.save(made, path)
    return [f"{name:10} {_numbers(points, faces)}" for name, faces in joined.items()]


def _regions(axes: Any, points: Floats) -> None:
    """Voronoi regions within the pane: its mirror images bound those at its edges."""
    from matplotlib.collections import LineCollection

    # moved inwards a little: a point on the edge must not be its own image
    inner = points * (1 - 1e-5)
    images = [inner, *(inner * flip + shift for flip, shift in (
        ((-1, 1), (1, 0)), ((-1, 1), (-1, 0)), ((1, -1), (0, 1)), ((1, -1), (0, -1))))]
    diagram = Voronoi(np.concatenate(images))
    kept = [ends for pair, ends in zip(diagram.ridge_points, diagram.ridge_vertices, strict=True)
            if pair.min() < len(points) and min(ends) >= 0]
    axes.add_collection(LineCollection(list(diagram.vertices[np.array(kept)]), colors=paper.LINE,
                                       linewidths=0.6))


def _numbers(points: Floats, faces: Ints) -> str:
    twin = twins(faces)
    border = np.count_nonzero(twin == NO_TWIN)
    ends = sides(faces)[(twin == NO_TWIN) | (twin > np.arange(len(twin)))]
    length = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1).sum()
    forward = np.roll(points[faces], -1, axis=1) - points[faces]
    backward = np.roll(points[faces], 1, axis=1) - points[faces]
    cross = forward[..., 0] * backward[..., 1] - forward[..., 1] * backward[..., 0]
    angle = np.degrees(np.arctan2(cross, (forward * backward).sum(axis=2)))
    return (f"{len(points)} points, {border} on the border, {len(faces)} triangles "
            f"(2 n - 2 - h = {2 * len(points) - 2 - border}), edges {length:.1f} long in all, "
            f"median of the smallest angles {np.median(angle.min(axis=1)):.1f} degrees")
