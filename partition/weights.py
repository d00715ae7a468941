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


def dihedral_graph(mesh: Mesh, mass: str) -> Graph:
    """Triangles as nodes, with area or 1 as mass ("area", "count")."""
    normal = area_vectors(mesh.vertices, mesh.faces)
    area = mesh.areas
    side, other = _inner(mesh)
    a, b = side // 3, other // 3
    length = _lengths(mesh, side)
    angle = folds(normal, mesh.vertices, mesh.faces, side, other, mesh.closed)
    width = 2 * (area[a] + area[b]) / (3 * length)
    weight = length / (width + np.sqrt(area.sum()) * angle)
    return Graph(area if mass == "area" else np.ones(len(area)), a, b, weight, length,
                 length / (1 + FOLD_RELIEF * angle))


def thesis_graph(mesh: Mesh, mass: str) -> Graph:
    """Vertices as nodes, with a third of the area around them or 1 as mass."""
    bend = abs(curvature(mesh))
    least = max(BLUNT * float(np.median(bend)), FLAT * float(bend.mean())) or 1.0
    flexible = 1 / (bend + least)
    side = np.flatnonzero((mesh.twin == NO_TWIN) | (mesh.twin > np.arange(len(mesh.twin))))
    a, b = mesh.faces.ravel()[side], np.roll(mesh.faces, -1, axis=1).ravel()[side]
    ring = ring_areas(mesh) / 3 if mass == "area" else np.ones(len(mesh.vertices))
    length = _lengths(mesh, side)
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
def folds(normal: Floats, vertices: Floats, faces: Ints, side: Ints, other: Ints,
          concave: bool) -> Floats:
    """(e,) the angle between the normals (f, 3) of any length across each edge, given by a side and
    its twin; with `concave`, convex folds count as 0."""
    angle = np.empty(len(side))
    for e in range(len(side)):
        n, m = normal[side[e] // 3], normal[other[e] // 3]
        start = vertices[faces[side[e] // 3, side[e] % 3]]
        apex = vertices[faces[other[e] // 3, (other[e] + 2) % 3]]
        if concave and n[0] * (apex[0] - start[0]) + n[1] * (apex[1] - start[1]) \
                + n[2] * (apex[2] - start[2]) <= 0:
            angle[e] = 0.0
            continue
        x = n[1] * m[2] - n[2] * m[1]
        y = n[2] * m[0] - n[0] * m[2]
        z = n[0] * m[1] - n[1] * m[0]
        angle[e] = np.arctan2(np.sqrt(x * x + y * y + z * z),
                              n[0] * m[0] + n[1] * m[1] + n[2] * m[2])
    return angle


def _inner(mesh: Mesh) -> tuple[Ints, Ints]:
    """Each inner edge once: its lower side and the twin."""
    side = np.flatnonzero(mesh.twin > np.arange(len(mesh.twin)))
    return side, mesh.twin[side]


def _lengths(mesh: Mesh, side: Ints) -> Floats:
    return side_lengths(mesh.vertices, mesh.faces, side)


@njit(cache=True)
def side_lengths(vertices: Floats, faces: Ints, side: Ints) -> Floats:
    """(e,) of some sides of triangles."""
    length = np.empty(len(side))
    for e in range(len(side)):
        face, corner = faces[side[e] // 3], side[e] % 3
        p, q = vertices[face[corner]], vertices[face[(corner + 1) % 3]]
        length[e] = np.sqrt((p[0] - q[0])**2 + (p[1] - q[1])**2 + (p[2] - q[2])**2)
    return length
