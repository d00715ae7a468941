"""What travels between the parts of the renderer: batches of rays, their hits and lit points.

They are named tuples of arrays, so that kernels take them whole.
"""

from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Rays(NamedTuple):
    """A batch of n rays.

    origin, direction   (n, 3), L and unit vectors
    weight              (n, 3) share of the radiance it finds that reaches its pixel
    pixel               (n,) index into the image
    seed                (n,) random key of its sample
    inside              (n,) how many glass pieces it is in; pieces that overlap count as one body
    medium              (n,) material of the glass it entered first, -1 in air
    """

    origin: Array
    direction: Array
    weight: Array
    pixel: Integers
    seed: Integers
    inside: Integers
    medium: Integers


class Hits(NamedTuple):
    """Where n rays meet the first surface.

    distance    (n,) L, inf where there is none
    surface     (n,) triangle below the number of triangles, above it a primitive; -1 none
    u, v        (n,) barycentric coordinates in the triangle
    """

    distance: Array
    surface: Integers
    u: NDArray[np.float32]
    v: NDArray[np.float32]


class Lit(NamedTuple):
    """Surface points that wait for the light of lamps.

    position, normal    (n, 3) the position is lifted off the surface
    viewer              (n, 3) unit vector to where the ray came from
    tangent             (n, 3) along u, for anisotropic highlights
    weight              (n, 3) of the ray
    diffuse, specular   (n, 3) coefficients times colours
    exponents           (n, 2) sharpness along u and v
    metal               (n,) 1 for Ashikhmin and Shirley's lighting, 0 for Phong's
    pixel, seed         (n,) of the ray
    """

    position: Array
    normal: Array
    viewer: Array
    tangent: Array
    weight: Array
    diffuse: Array
    specular: Array
    exponents: Array
    metal: Integers
    pixel: Integers
    seed: Integers


Batch = TypeVar("Batch", Rays, Lit)


def chosen(batch: Batch, which: Any) -> Batch:
    """Some of a batch, by slice, index or mask."""
    return type(batch)._make(column[which] for column in batch)


def allocate(count: int) -> Rays:
    """Rays that a kernel will fill."""
    return Rays(np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3)),
                np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64),
                np.empty(count, np.int64))


def allocate_lit(count: int) -> Lit:
    """Points that a kernel will fill."""
    return Lit(np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3)),
               np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3)),
               np.empty((count, 3)), np.empty((count, 2)), np.empty(count, np.int64),
               np.empty(count, np.int64), np.empty(count, np.int64))
