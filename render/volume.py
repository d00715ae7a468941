"""How do fire and smoke look along a ray? Emission and absorption, front to back.

Each cell holds heat (temperature as a share of the shown range) and soot (density in units of its
reference). With the absorption s = s_fire(heat) + s_smoke soot and the source colour
I = (s_fire I_fire(heat) + s_smoke soot I_smoke) / s, a step dz of a ray does
    a = 1 - exp(-s dz),    C += (1 - A) a I,    A += (1 - A) a          (the thesis' A.3 and A.4)
until A > 0.999; what lies behind counts (1 - A). The steps divide the way through the box exactly
and end at the first surface; values are trilinear between cell centres, and turned to colour after
interpolation. Every ray shifts its sample points within the steps by one random number, which
turns bands into fine grain. Bricks of cells that hold nothing are skipped; that changes no sample.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from render.hashing import uniform
from render.kernel import kernel
from render.primitives import slabs
from render.rays import Hits, Rays
from render.vector import Three, load

BRICK = 4           # cells along the edge of a brick
OPAQUE = 0.999
ENTRIES = 1024      # of the colour table
Array = NDArray[np.float64]
Single = NDArray[np.float32]


class Volume(NamedTuple):
    """A frame's fire and smoke.

    cells       (nz + 2, ny + 2, nx + 2, 2) float32: heat in [0, 1] and soot; the outermost layer
                repeats its neighbour, so that every point of the box lies between eight values
    filled      bricks (bz, by, bx): whether anything in it, or in its neighbours' rim, is visible
    size        (3,) edges of the box, L
    table       (ENTRIES, 4) by heat: emitted linear RGB, absorption in 1/L
    smoke       (4,) RGB of lit smoke, absorption per soot in 1/L
    step        L
    """

    cells: Single
    filled: NDArray[np.bool_]
    size: Array
    table: Array
    smoke: Array
    step: float


@kernel
def march(volume: Volume, rays: Rays, hits: Hits, image: Array) -> None:
    """Add what the rays see of the volume before their hits to `image`, and weaken the rays."""
    for ray in range(rays.pixel.size):
        red, green, blue, clear = along_ray(volume, load(rays.origin, ray),
                                            load(rays.direction, ray), hits.distance[ray],
                                            uniform(rays.seed[ray], 7))
        pixel = rays.pixel[ray]
        image[pixel, 0] += rays.weight[ray, 0] * red
        image[pixel, 1] += rays.weight[ray, 1] * green
        image[pixel, 2] += rays.weight[ray, 2] * blue
        for c in range(3):
            rays.weight[ray, c] *= clear


@kernel
def along_ray(volume: Volume, o: Three, d: Three, reach: float,
              xi: float) -> tuple[float, float, float, float]:
    """(red, green, blue, transparency) of the way from o to o + reach d."""
    size = volume.size
    enter, leave = slabs((0.0, 0.0, 0.0), (size[0], size[1], size[2]), o, d)
    enter, leave = max(enter, 0.0), min(leave, reach)
    red = green = blue = 0.0
    clear = 1.0
    if enter >= leave:
        return red, green, blue, clear
    nz, ny, nx = volume.cells.shape[0] - 2, volume.cells.shape[1] - 2, volume.cells.shape[2] - 2
    # in units of cells: positions g = a + t b, of which the box is [0, nx] x [0, ny] x [0, nz]
    bx, by, bz = d[0] * nx / size[0], d[1] * ny / size[1], d[2] * nz / size[2]
    ax, ay, az = o[0] * nx / size[0], o[1] * ny / size[1], o[2] * nz / size[2]
    steps = int(np.ceil((leave - enter) / volume.step))
    dz = (leave - enter) / steps
    k = 0
    while k < steps:
        t = enter + (k + xi) * dz
        x, y, z = ax + t * bx, ay + t * by, az + t * bz
        i = min(max(int(x), 0), nx - 1) // BRICK
        j = min(max(int(y), 0), ny - 1) // BRICK
        m = min(max(int(z), 0), nz - 1) // BRICK
        if not volume.filled[m, j, i]:
            out = min(_exit(x, bx, i), min(_exit(y, by, j), _exit(z, bz, m)))
            k += max(1, int(np.ceil(out / dz)))
            continue
        k += 1
        heat, soot = _sample(volume.cells, x + 0.5, y + 0.5, z + 0.5)
        place = heat * (ENTRIES - 1)
        e = min(int(place), ENTRIES - 2)
        f = place - e
        table = volume.table
        fire = (1.0 - f) * table[e, 3] + f * table[e + 1, 3]
        smoke = volume.smoke[3] * soot
        total = fire + smoke
        if total <= 0.0:
            continue
        seen = clear * (1.0 - np.exp(-total * dz))
        fire, smoke = seen * fire / total, seen * smoke / total
        red += fire * ((1.0 - f) * table[e, 0] + f * table[e + 1, 0]) + smoke * volume.smoke[0]
        green += fire * ((1.0 - f) * table[e, 1] + f * table[e + 1, 1]) + smoke * volume.smoke[1]
        blue += fire * ((1.0 - f) * table[e, 2] + f * table[e + 1, 2]) + smoke * volume.smoke[2]
        clear -= seen
        if clear < 1.0 - OPAQUE:
            return red, green, blue, 0.0
    return red, green, blue, clear


@kernel
def _exit(x: float, slope: float, brick: int) -> float:
    """How far along the ray, L, a coordinate leaves its brick."""
    if slope > 0.0:
        return ((brick + 1) * BRICK - x) / slope
    return (brick * BRICK - x) / slope if slope < 0.0 else np.inf


@kernel
def _sample(cells: Single, x: float, y: float, z: float) -> tuple[float, float]:
    """Trilinear heat and soot at (x, y, z) counted from the centre of the outermost cell."""
    i, j, k = max(int(x), 0), max(int(y), 0), max(int(z), 0)
    i, j, k = (min(i, cells.shape[2] - 2), min(j, cells.shape[1] - 2), min(k, cells.shape[0] - 2))
    x, y, z = x - i, y - j, z - k
    heat = soot = 0.0
    for b in range(2):
        for a in range(2):
            share = (z if b else 1.0 - z) * (y if a else 1.0 - y)
            low, high = cells[k + b, j + a, i, 0], cells[k + b, j + a, i + 1, 0]
            heat += share * (low + x * (high - low))
            low, high = cells[k + b, j + a, i, 1], cells[k + b, j + a, i + 1, 1]
            soot += share * (low + x * (high - low))
    return heat, soot
