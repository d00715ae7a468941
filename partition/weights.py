"""How strongly do neighbouring parts of a surface hold together?

A cut by eigenvectors goes where the graph of the mesh is weak. Two graphs are offered.

dihedral (the default): triangles are the nodes; the link across the edge e between a and b is a
conductance, a strip of surface of width d and a crease in series,

    w_e = l_e / (d_e + L phi_e)       d_e = (h_a + h_b) / 3,  L = sqrt(total area)

with l_e the length of the edge, h the heights of the triangles above it (a third of it: the
distance of the centroid) and phi_e the angle of the fold: 0 where it is flat. Without folds this
is the finite-volume form of -div grad, so it does not depend on the mesh. On a closed surface only
concave folds count (a neck, an armpit), on an open one all do.

thesis (4.2): vertices are the nodes, and the weight of an edge is the mean over its ends of

    q_i = 1 / (|kappa_i| + kappa_0),     kappa_i = 3 dtheta_i / A_i

where dtheta_i is 2 pi (on a border: pi) less the angles of the triangles around vertex i and A_i
their area. The thesis prints A / (3 dtheta) as "the curvature"; it is the inverse of the Gaussian
curvature, is infinite on a plane and negative on a saddle, and only its magnitude gives weights for
which the Laplacian has no negative eigenvalue. The small term kappa_0 keeps it finite: 0.01 of the
median |kappa| or, where most of the surface is flat or bent one way only and the median is 0 or
nothing but rounding, 0.001 of the mean.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from partition.graph import NO_TWIN, Ints
from partition.measure import area_vectors
from partition.mesh import Mesh

Floats = NDArray[np.float64]
BLUNT = 0.01        # of the median curvature
FLAT = 0.001        # of the mean curvature
FOLD_RELIEF = 3.0   # a cut of length l along a fold of angle phi costs l / (1 + 3 phi)


@dataclass(frozen=True)
class Graph:
    """Nodes 0 ... n - 1 with positive masses (n,) and links a-b (e,), of positive weights (e,).

    length (e,) is that of the mesh's edge, cost (e,) the price of a cut along it, L.
    """

    mass: Floats
    a: Ints
    b: Ints
    weight: Floats
    length: Floats
    cost: Floats


def dihedral_graph(mesh: Mesh, mass: str, comm: Any = None) -> Graph:
    """Triangles as nodes, with area or 1 as mass ("area", "count"); the ranks of `comm` (None: this
    process alone) weigh a share of the links each."""
    area, (side, a, b) = mesh.areas, _links(mesh.twin)
    rank, ranks = (0, 1) if comm is None else (comm.rank, comm.size)
    bounds = np.arange(ranks + 1) * len(side) // ranks
    weight, length, cost = _folded_strips(
        mesh.vertices, mesh.faces, mesh.twin, area, np.sqrt(area.sum()), mesh.closed,
        side[bounds[rank]:bounds[rank + 1]])
    if ranks > 1:
        weight, length, cost = (_gathered(share, bounds, comm) for share in (weight, length, cost))
    return Graph(area if mass == "area" else np.ones(len(area)), a, b, weight, length, cost)


def _gathered(share: Floats, bounds: Ints, comm: Any) -> Floats:
    """(e,) from the shares of all ranks, rank r's beginning at bounds[r]."""
    whole = np.empty(bounds[-1])
    comm.Allgatherv(share, (whole, np.diff(bounds)))
    return whole


def thesis_graph(mesh: Mesh, mass: str) -> Graph:
    """Vertices as nodes, with a third of the area around them or 1 as mass."""
    bend = abs(curvature(mesh))
    least = max(BLUNT * float(np.median(bend)), FLAT * float(bend.mean())) or 1.0
    flexible = 1 / (bend + least)
    side = np.flatnonzero((mesh.twin == NO_TWIN) | (mesh.twin > np.arange(len(mesh.twin))))
    a, b = mesh.faces.ravel()[side], np.roll(mesh.faces, -1, axis=1).ravel()[side]
    ring = ring_areas(mesh) / 3 if mass == "area" else np.ones(len(mesh.vertices))
    length = np.linalg.norm(mesh.vertices[a] - mesh.vertices[b], axis=1)
    return Graph(ring, a, b, (flexible[a] + flexible[b]) / 2, length, length)


def curvature(mesh: Mesh) -> Floats:
    """(v,) Gaussian curvature 3 dtheta / A at each vertex, 1/L2."""
    return 3 * angle_defects(mesh) / ring_areas(mesh)


def angle_defects(mesh: Mesh) -> Floats:
    """(v,) 2 pi, on a border pi, less the angles of the triangles at each vertex."""
    corners = mesh.vertices[mesh.faces]
    forward = np.roll(corners, -1, axis=1) - corners
    backward = np.roll(corners, 1, axis=1) - corners
    angle = np.arctan2(np.linalg.norm(np.cross(forward, backward), axis=2),
                       (forward * backward).sum(axis=2))
    defect = 2 * np.pi - np.bincount(mesh.faces.ravel(), angle.ravel(), len(mesh.vertices))
    border = np.flatnonzero(mesh.twin == NO_TWIN)
    ends = np.concatenate([mesh.faces.ravel()[border],
                           np.roll(mesh.faces, -1, axis=1).ravel()[border]])
    defect[np.unique(ends)] -= np.pi
    return defect


def ring_areas(mesh: Mesh) -> Floats:
    """(v,) area of the triangles around each vertex."""
    area = np.repeat(mesh.areas, 3)
    ring: Floats = np.bincount(mesh.faces.ravel(), area, len(mesh.vertices)).astype(np.float64)
    return ring


@njit(cache=True)
def _links(twin: Ints) -> tuple[Ints, Ints, Ints]:
    """The lower side (e,) of every edge between two triangles, and these triangles a-b (e,)."""
    side = np.flatnonzero(twin > np.arange(len(twin)))
    a, b = np.empty(len(side), dtype=np.int64), np.empty(len(side), dtype=np.int64)
    for e in range(len(side)):
        a[e], b[e] = side[e] // 3, twin[side[e]] // 3
    return side, a, b


@njit(cache=True)
def _folded_strips(vertices: Floats, faces: Ints, twin: Ints, area: Floats, crease: float,
                   concave: bool, sides: Ints) -> tuple[Floats, Floats, Floats]:
    """Weight, length and cost of the links across `sides` (e,); `crease` is L, and with `concave`
    convex folds count as 0."""
    weight, length, cost = np.empty(len(sides)), np.empty(len(sides)), np.empty(len(sides))
    normal = area_vectors(vertices, faces)
    for e in range(len(sides)):
        side, other = sides[e], twin[sides[e]]
        f, g = side // 3, other // 3
        start, end, apex = faces[f, side % 3], faces[f, (side + 1) % 3], faces[g, (other + 2) % 3]
        square, rise = 0.0, 0.0
        for x in range(3):
            square += (vertices[end, x] - vertices[start, x])**2
            rise += normal[f, x] * (vertices[apex, x] - vertices[start, x])
        angle = 0.0 if concave and rise <= 0 else _angle(normal, f, g)
        length[e] = np.sqrt(square)
        width = 2 * (area[f] + area[g]) / (3 * length[e])
        weight[e] = length[e] / (width + crease * angle)
        cost[e] = length[e] / (1 + FOLD_RELIEF * angle)
    return weight, length, cost


@njit(inline="always")
def _angle(normal: Floats, f: int, g: int) -> float:
    """Between the normals, of any length, of two triangles."""
    x = normal[f, 1] * normal[g, 2] - normal[f, 2] * normal[g, 1]
    y = normal[f, 2] * normal[g, 0] - normal[f, 0] * normal[g, 2]
    z = normal[f, 0] * normal[g, 1] - normal[f, 1] * normal[g, 0]
    return float(np.arctan2(np.sqrt(x * x + y * y + z * z),
                            normal[f, 0] * normal[g, 0] + normal[f, 1] * normal[g, 1]
                            + normal[f, 2] * normal[g, 2]))
