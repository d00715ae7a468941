"""Mass, centre and inertia of a piece from its triangles.

Closed surface: the tetrahedra (0, a, b, c) of its faces, with signed volume V = a·(b×c)/6,
    centre = Σ V (a+b+c)/4 / ΣV,     ∫ x xᵀ dV = Σ V/20 (s sᵀ + a aᵀ + b bᵀ + c cᵀ),  s = a+b+c
Open surface: the triangles, with area A,
    centre = Σ A (a+b+c)/3 / ΣA,     ∫ x xᵀ dA = Σ A/12 (s sᵀ + a aᵀ + b bᵀ + c cᵀ)
Inertia I = tr(M) 1 - M about the centre, M = ∫ (x - centre)(x - centre)ᵀ dm. Exact for polyhedra.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MassProperties:
    """mass M, centre (3,) L, inertia (3, 3) M L² about the centre, vertex_area (nv,) L²."""

    mass: float
    centre: Array
    inertia: Array
    vertex_area: Array


def mass_properties(vertices: Array, faces: NDArray[np.int32], closed: bool,
                    density: float | None, areal_density: float | None) -> MassProperties:
    """Of one piece; mass by volume (closed) where `density` is given, else by surface area."""
    corners = vertices[faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0],
                                         corners[:, 2] - corners[:, 0]), axis=1)
    vertex_area = np.bincount(faces.ravel(), np.repeat(area / 3, 3), len(vertices)).astype(float)
    origin = vertices.mean(axis=0)   # near the piece: sums of large numbers would cancel
    corners = corners - origin
    if closed:
        weight = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        first, second = 1 / 4, 1 / 20
    else:
        weight, first, second = area, 1 / 3, 1 / 12
    if weight.sum() <= 0:
        raise ValueError("a piece has no volume (closed) or no area (open): check its mesh")
    total = weight.sum()
    mass = areal_density * area.sum() if areal_density is not None else density * total
    sums = corners.sum(axis=1)
    centre = first * weight @ sums / total
    points = np.concatenate([sums[:, None], corners], axis=1)
    moments = second * np.einsum("f,fpi,fpj->ij", weight, points, points)
    moments = (moments - total * np.outer(centre, centre)) * mass / total
    inertia = np.trace(moments) * np.eye(3) - moments
    return MassProperties(float(mass), centre + origin, inertia, vertex_area)
