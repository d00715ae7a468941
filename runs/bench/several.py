"""Do several eigenvectors at once cut better than one after the other?

Into k pieces at once (Ng, Jordan and Weiss 2002; Alpert, Kahng and Yao 1999): the triangles become
points whose coordinates are the k - 1 slowest modes, these are grouped by k-means, and what hangs
off a group goes to the neighbour it shares most length with. Beside it the recursion of
`partition.divide`. Total length of the cuts, the largest piece over the mean, and the parts that
the groups were in before they were mended.
"""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.cluster.vq import kmeans2

from partition.divide import divide
from partition.graph import Ints, components, cut_twins
from partition.mesh import Mesh
from partition.spectral import modes
from partition.weights import Graph, dihedral_graph
from solver.scene_body import Cut

STARTS = 5      # of k-means, the best of which counts


def compare(name: str, mesh: Mesh, pieces: tuple[int, ...]) -> Iterator[dict[str, Any]]:
    """A row for either way and each number of pieces."""
    graph = dihedral_graph(mesh, "area")
    for count in pieces:
        began = time.perf_counter()
        label, _ = divide(mesh, Cut(method="spectral"), count)
        yield {"body": name, "pieces": count, "by": "recursion",
               "seconds": time.perf_counter() - began, "parts": count, **_quality(graph, label)}
        began = time.perf_counter()
        label, parts = at_once(mesh, graph, count)
        yield {"body": name, "pieces": count, "by": "k-way",
               "seconds": time.perf_counter() - began, "parts": parts, **_quality(graph, label)}


def at_once(mesh: Mesh, graph: Graph, count: int) -> tuple[Ints, int]:
    """(f,) the piece of each triangle, and how many parts the groups were in."""
    places = modes(graph, count - 1).vectors
    best, least = np.zeros(len(places), dtype=np.int64), np.inf
    for seed in range(STARTS):
        centres, label = kmeans2(places, count, minit="++", seed=seed)
        spread = float(graph.mass @ ((places - centres[label])**2).sum(axis=1))
        if spread < least and len(np.unique(label)) == count:
            best, least = label.astype(np.int64), spread
    parts = int(components(len(best), cut_twins(mesh.twin, best)).max()) + 1
    return _mended(mesh, graph, best), parts


def _mended(mesh: Mesh, graph: Graph, label: Ints) -> Ints:
    """With every piece whole."""
    while True:
        part = components(len(label), cut_twins(mesh.twin, label))
        weight = np.bincount(part, graph.mass)
        owner = np.zeros(len(weight), dtype=np.int64)
        owner[part] = label
        heaviest = [np.flatnonzero(owner == piece)[np.argmax(weight[owner == piece])]
                    for piece in np.unique(label)]
        lost = np.setdiff1d(np.arange(len(weight)), heaviest)
        if len(lost) == 0:
            return label
        smallest = lost[np.argmin(weight[lost])]
        border = (part[graph.a] == smallest) != (part[graph.b] == smallest)
        other = np.where(part[graph.a] == smallest, label[graph.b], label[graph.a])[border]
        label = np.where(part == smallest, np.argmax(np.bincount(other, graph.length[border])),
                         label)


def _quality(graph: Graph, label: Ints) -> dict[str, Any]:
    size = np.bincount(label, graph.mass)
    return {"length": graph.length[label[graph.a] != label[graph.b]].sum(),
            "largest": size.max() / size.mean(), "smallest": size.min() / size.mean()}
