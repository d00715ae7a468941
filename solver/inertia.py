"""Mass, centre and inertia of a piece from its triangles.

Closed surface: the tetrahedra (0, a, b, c) of its faces, with signed volume V = a·(b×c)/6,
    centre = Σ V (a+b+c)/4 / ΣV,     ∫ x xᵀ dV = Σ V/20 (s sᵀ + a aᵀ + b bᵀ + c cᵀ),  s = a+b+c
Open surface: the triangles, with area A,
    centre = Σ A (a+b+c)/3 / ΣA,     ∫ x xᵀ dA = Σ A/12 (s sᵀ + a aᵀ + b bᵀ + c cᵀ)
Inertia I = tr(M) 1 - M about the centre, M = ∫ (x - centre)(x - centre)ᵀ dm. Exact for polyhedra.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Faces = NDArray[np.integer[Any]]


@dataclass(frozen=True)
class MassProperties:
    """mass M, centre (3,) L, inertia (3, 3) M L² about the centre, vertex_area (nv,) L²."""

    mass: float
    centre: Array
    inertia: Array
    vertex_area: Array

    def with_mass(self, mass: float) -> "MassProperties":
        """The same shape with another mass."""
        return replace(self, mass=mass, inertia=self.inertia * (mass / self.mass))


def mass_properties(vertices: Array, faces: Faces, closed: bool, density: float | None,
                    areal_density: float | None) -> MassProperties:
    """Of one piece: mass by surface area where `areal_density` is given, else by `density` times
    the volume of a closed piece. ValueError: no volume or no area, or an open piece with no areal
    density."""
    corners = vertices[faces]
    area = triangle_areas(corners)
    vertex_area = np.bincount(faces.ravel(), np.repeat(area / 3, 3), len(vertices)).astype(float)
    origin = vertices.mean(axis=0)   # near the piece: sums of large numbers would cancel
    corners = corners - origin
    weight, first, second = ((tetrahedra(corners), 1 / 4, 1 / 20) if closed
                             else (area, 1 / 3, 1 / 12))
    total = weight.sum()
    if total <= 0:
        raise ValueError("a piece has no volume (closed) or no area (open): check its mesh")
    if areal_density is not None:
        mass = areal_density * area.sum()
    elif closed and density is not None:
        mass = density * total
    else:
        raise ValueError("an open piece has a mass only by its area")
    sums = corners.sum(axis=1)
    centre = first * weight @ sums / total
    points = np.concatenate([sums[:, None], corners], axis=1)
    moments = second * np.einsum("f,fpi,fpj->ij", weight, points, points)
    moments = (moments - total * np.outer(centre, centre)) * mass / total
    inertia = np.trace(moments) * np.eye(3) - moments
    return MassProperties(float(mass), centre + origin, inertia, vertex_area)


def triangle_areas(corners: Array) -> Array:
    """(f,) of (f, 3, 3) corners."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas: Array = 0.5 * np.linalg.norm(normal, axis=1)
    return areas


def tetrahedra(corners: Array) -> Array:
    """(f,) signed volumes of the tetrahedra from the origin to each triangle."""
    volumes: Array = np.einsum("ij,ij->i", corners[:, 0],
                               np.cross(corners[:, 1], corners[:, 2])) / 6
    return volumes


def shell_density(corners: Array, density: float) -> float:
    """What one area weighs if a closed surface, given by all its triangles in whatever open pieces,
    shares out the mass of the solid it encloses. ValueError: the surface is not closed."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = triangle_areas(corners).sum()
    if np.linalg.norm(normal.sum(axis=0)) > 1e-8 * area:
        raise ValueError("its surface is open, so it has no volume")
    volume = tetrahedra(corners - corners.mean(axis=(0, 1))).sum()
    if volume <= 0:
        raise ValueError("its surface is inside out")
    return float(density * volume / area)


def smallest_edge_inertia(vertices: Array, mass: float) -> Array:
    """The thesis' 2 m a²/3 for every shape and axis, a: the shortest edge of the bounding box.
    ValueError: the piece is flat along an axis, which would leave it without inertia."""
    extent = np.ptp(vertices, axis=0)
    if extent.min() <= 1e-9 * extent.max():
        raise ValueError("a piece is flat, so it would have no inertia")
    inertia: Array = 2 / 3 * mass * extent.min() ** 2 * np.eye(3)
    return inertia
