"""What else does a compositor want of a frame? Depth, normal, piece and temperature of each pixel.

They belong to the ray through the middle of the pixel, without samples: averages of two pieces'
numbers mean nothing.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from render.camera import Pinhole, middle_rays
from render.kernel import kernel
from render.primitives import Primitives
from render.rays import Array, Hits, Integers, Rays
from render.surfaces import Surfaces, outward_normal
from render.triangles import Triangles
from render.vector import along, load, store
from render.volume import Volume, hottest

NOTHING = 0     # number of no piece; piece i is i + 1


class Layers(NamedTuple):
    """Images (height, width).

    depth           L along the ray to the first surface, inf where there is none
    normal          (height, width, 3) of that surface, outward; zero where there is none
    piece           uint32, number of the piece + 1, 0 for everything else
    temperature     the highest along the ray to that surface, in the scene's unit; ambient without
                    fire
    """

    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    piece: NDArray[np.uint32]
    temperature: NDArray[np.float32]


def layers(camera: Pinhole, size: tuple[int, int], surfaces: Surfaces, volume: Volume | None,
           low: float, high: float) -> Layers:
    """Layers of a picture of `size` (width, height); heat 0 to 1 is the temperature low to high."""
    rays = middle_rays(camera, size)
    hits = surfaces.closest(rays)
    count, shape = len(rays.pixel), (size[1], size[0])
    normal, piece = np.zeros((count, 3)), np.full(count, NOTHING, np.int64)
    _describe(surfaces.triangles, surfaces.primitives, rays, hits, normal, piece)
    heat = np.zeros(count)
    if volume is not None:
        hottest(volume, rays, hits, heat)
    return Layers(hits.distance.reshape(shape).astype(np.float32),
                  normal.reshape(*shape, 3).astype(np.float32),
                  piece.reshape(shape).astype(np.uint32),
                  (low + (high - low) * heat).reshape(shape).astype(np.float32))


@kernel
def _describe(triangles: Triangles, primitives: Primitives, rays: Rays, hits: Hits, normal: Array,
              piece: Integers) -> None:
    for ray in range(rays.pixel.size):
        surface = hits.surface[ray]
        if surface < 0:
            continue
        p = along(load(rays.origin, ray), hits.distance[ray], load(rays.direction, ray))
        store(normal, ray, outward_normal(triangles, primitives, surface, p))
        if surface < triangles.material.size:
            piece[ray] = triangles.piece[surface] + 1
